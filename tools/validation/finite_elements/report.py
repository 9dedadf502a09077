"""The recorded results as a section of the validation document, in Markdown."""

from tools.validation.finite_elements.design import PAPER_CASES, PAPER_WORST_PERCENT, TITLES
from tools.validation.finite_elements.explanation import paragraphs
from tools.validation.finite_elements.records import Record, finest, load, states, worst_error


def section() -> str:
    """The whole section, without a trailing newline."""
    results = load()
    parts = [
        "## Finite elements",
        _setting(results),
        "![Solved shapes and errors](images/finite_elements.png)",
        _case_table(results),
        _mesh_text(results),
        *paragraphs(results),
    ]
    return "\n\n".join(parts)


_SETTING = """\
The paper compares the lengths that its inverse kinematics gives with those of a simulation in
Abaqus and names the worst case: 1.6 %, one chamber at 1 bar. Here the same with an open solver,
{solver}: three chambers ({inner_radius:g} mm inner and {outer_radius:g} mm outer radius) at
d = {chamber_offset:g} mm, l0 = {rest_length:g} mm between the caps, joined by {discs} thin discs
and two stiff plates; no gravity. The wall is orthotropic: {hoop_modulus:g} MPa along the hoop,
where the fibres run, {wall_modulus:g} MPa along the axis and through the wall, so that a chamber
lengthens and does not balloon. The pressure acts on the inside of the walls and on both caps and
follows them as they turn; deformations are large; the elements are C3D20R.

From the tip plate in the solution (best rigid fit of its nodes, the tip in the middle of its inner
face) the inverse kinematics of `controllers/kinematics` gives three lengths. They are compared with
those of the chambers' centre lines in the solution, from cap to cap: error = (inverse kinematics -
solution) / solution. The table shows the finest mesh on which a case was solved. The last three
cases are not in the paper."""


def _setting(results: Record) -> str:
    return _SETTING.format(solver=results["solver"], **results["design"])


def _case_table(results: Record) -> str:
    lines = [
        "| Chambers | bar | bend, deg | tip x, y, z, mm | solved lengths, mm "
        "| inverse kinematics, mm | error per chamber, % | the paper, % |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for case in TITLES:
        lines += [_case_row(case, row) for row in states(results, finest(results, case), case)]
    return "\n".join(lines)


def _case_row(case: str, row: Record) -> str:
    worst_case = case == "one" and row["pressure_bar"] == 1.0
    paper = f"{PAPER_WORST_PERCENT}" if worst_case else f"at most {PAPER_WORST_PERCENT}"
    cells = [
        TITLES[case],
        f"{row['pressure_bar']:g}",
        f"{row['bend_deg']:.2f}",
        _numbers(row["tip_position"], 2),
        _numbers(row["lengths_solved"], 2),
        _numbers(row["lengths_inverse"], 2),
        _numbers(row["error_percent"], 3),
        paper if case in PAPER_CASES else "",
    ]
    return "| " + " | ".join(cells) + " |"


def _numbers(values: list[float], digits: int) -> str:
    """Rounded, without a minus sign before zero."""
    return ", ".join(f"{round(value, digits) + 0.0:.{digits}f}" for value in values)


def _mesh_text(results: Record) -> str:
    sizes = [
        f"{row['mesh']}: {row['elements']} elements, {row['nodes']} nodes"
        for row in results["cases"]
        if row["case"] == PAPER_CASES[0]
    ]
    lines = [
        f"Refining the mesh ({'; '.join(sizes)}), at the highest pressure:",
        "",
        "| Chambers | mesh | tip x, z, mm | longest chamber, mm | largest error, % |",
        "|---|---|---|---|---|",
    ]
    for case in PAPER_CASES:
        for mesh in results["meshes"]:
            for row in states(results, mesh, case)[-1:]:
                x, _, z = row["tip_position"]
                lines.append(
                    f"| {TITLES[case]} | {mesh} | {_numbers([x, z], 3)} "
                    f"| {max(row['lengths_solved']):.3f} | {worst_error(row):.4f} |"
                )
    return "\n".join(lines)
