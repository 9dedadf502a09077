"""The finite elements: mesh, evaluation and record, and the solver where it is installed.

No full case is solved here; `python -m tools.validation.finite_elements` does that.
"""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pneuarm.controllers.kinematics.constant_curvature import (
    lengths_from_shapes,
    section_transforms,
)
from tools.validation.finite_elements import records, report, solver
from tools.validation.finite_elements.deck import write_deck
from tools.validation.finite_elements.design import (
    CASES,
    MESHES,
    PAPER_CASES,
    RUNS,
    TITLES,
    Design,
    design_of,
)
from tools.validation.finite_elements.evaluation import compare, model_lines, rigid_fit
from tools.validation.finite_elements.mesh import Mesh, build_mesh
from tools.validation.finite_elements.quality import jacobians, volumes
from tools.validation.finite_elements.solution import SolverFailed, read_displacements

Array = NDArray[np.float64]

DESIGN = Design()
TINY_DESIGN = replace(DESIGN, rest_length=40.0, discs=1)
TINY_MESH = replace(MESHES["coarse"], along=2)

#: Bent shapes (L in mm, u and v in rad), the straight arm among them.
SHAPES = np.array([[171.7, 0, 0], [184.0, -0.6, 0.0], [190.0, 0.3, 0.5], [160.0, -1e-7, 1.2]])


@pytest.fixture(scope="module", params=MESHES)
def mesh(request: pytest.FixtureRequest) -> Mesh:
    return build_mesh(DESIGN, MESHES[request.param])


def test_every_element_is_right_side_out(mesh: Mesh) -> None:
    determinants = jacobians(mesh.nodes, mesh.hexes)
    assert determinants.min() > 0.0
    assert (determinants.min(axis=1) / determinants.max(axis=1)).min() > 0.2


def test_the_walls_have_the_volume_of_three_tubes(mesh: Mesh) -> None:
    ring = np.pi * (DESIGN.outer_radius**2 - DESIGN.inner_radius**2)
    for chamber in (1, 2, 3):
        wall = mesh.hexes[mesh.parts[f"WALL{chamber}"]]
        np.testing.assert_allclose(
            volumes(mesh.nodes, wall).sum(), ring * DESIGN.rest_length, rtol=2e-4
        )


def test_every_element_has_one_material_and_every_node_an_element(mesh: Mesh) -> None:
    elements = np.sort(np.concatenate(list(mesh.parts.values())))
    np.testing.assert_array_equal(elements, np.arange(len(mesh.hexes)))
    np.testing.assert_array_equal(np.unique(mesh.hexes), np.arange(len(mesh.nodes)))


def test_no_two_nodes_coincide(mesh: Mesh) -> None:
    assert len(np.unique(np.round(mesh.nodes, 5), axis=0)) == len(mesh.nodes)


def test_plates_lie_outside_the_caps(mesh: Mesh) -> None:
    base, tip = mesh.nodes[mesh.base_nodes, 2], mesh.nodes[mesh.tip_nodes, 2]
    np.testing.assert_allclose([base.min(), base.max()], [-DESIGN.plate_thickness, 0.0])
    top = DESIGN.rest_length + DESIGN.plate_thickness
    np.testing.assert_allclose([tip.min(), tip.max()], [DESIGN.rest_length, top])


def test_rings_run_along_the_chambers_axes_from_cap_to_cap(mesh: Mesh) -> None:
    centres = mesh.nodes[mesh.rings].mean(axis=2)
    along = model_lines(np.array([DESIGN.rest_length, 0.0, 0.0]), DESIGN.chamber_offset)
    np.testing.assert_allclose(centres[:, [0, -1]], along[:, [0, -1]], atol=1e-6)


def test_pressure_meets_a_closed_bore(mesh: Mesh) -> None:
    """The faces' nodes: walls on the inner radius, the caps in their planes."""
    corners = {1: [0, 1, 2, 3], 2: [4, 5, 6, 7], 6: [3, 0, 4, 7]}
    for chamber, faces in enumerate(mesh.pressed):
        axis = mesh.nodes[mesh.rings[chamber, 0]].mean(axis=0)[:2]
        for elements, face in faces:
            at = mesh.nodes[mesh.hexes[elements][:, corners[face]]]
            radius = np.linalg.norm(at[..., :2] - axis, axis=-1)
            if face == 6:
                np.testing.assert_allclose(radius, DESIGN.inner_radius, atol=1e-5)
            else:
                height = 0.0 if face == 2 else DESIGN.rest_length
                np.testing.assert_allclose(at[..., 2], height, atol=1e-9)
                assert radius.max() <= DESIGN.inner_radius + 1e-5


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_an_arc_is_recovered_exactly(mesh: Mesh, shape: Array) -> None:
    result = compare(DESIGN, mesh, _bent(mesh, shape) - mesh.nodes)
    expected = lengths_from_shapes(shape, DESIGN.chamber_offset)
    np.testing.assert_allclose(result.lengths_inverse, expected, rtol=1e-12)
    np.testing.assert_allclose(result.error_percent, 0.0, atol=1e-6)
    assert result.tip_turn_deg < 1e-9
    assert result.plate_misfit < 1e-9
    assert result.line_deviation.max() < 1e-3


def test_a_curve_that_is_no_arc_shows(mesh: Mesh) -> None:
    bowed = _bent(mesh, SHAPES[1])
    bowed[:, 1] += 2.0 * np.sin(np.pi * np.clip(mesh.nodes[:, 2] / DESIGN.rest_length, 0.0, 1.0))
    result = compare(DESIGN, mesh, bowed - mesh.nodes)
    assert result.line_deviation.min() > 1.8
    assert result.error_percent.max() < -0.02


def test_a_rigid_motion_is_fitted_without_a_mirror() -> None:
    before = np.random.default_rng(0).normal(size=(20, 3))
    rotation = section_transforms(SHAPES[2])[:3, :3]
    fitted, shift = rigid_fit(before, before @ rotation.T + [1.0, -2.0, 3.0])
    np.testing.assert_allclose(fitted, rotation, atol=1e-12)
    np.testing.assert_allclose(shift, [1.0, -2.0, 3.0], atol=1e-12)


def test_a_deck_presses_only_the_chambers_that_are_loaded(mesh: Mesh) -> None:
    loads = write_deck(DESIGN, mesh, CASES["two"]).split("*DLOAD\n")[1]
    assert "BORE1" not in loads
    assert loads.count("BORE2") == loads.count("BORE3") == 3
    assert "P6" not in write_deck(DESIGN, mesh, CASES["one, caps only"]).split("*DLOAD\n")[1]


def test_results_are_of_this_design_and_complete() -> None:
    results = records.load()
    assert results["design"] == vars(DESIGN)
    assert [(row["mesh"], row["case"]) for row in results["cases"]] == list(RUNS)
    for case in results["cases"]:
        pressures = [row["pressure_bar"] for row in case["states"]]
        assert pressures == list(CASES[case["case"]].pressures_bar)
        mesh = build_mesh(design_of(case["case"]), MESHES[case["mesh"]])
        assert (case["nodes"], case["elements"]) == (len(mesh.nodes), len(mesh.hexes))


def test_recorded_errors_follow_from_the_recorded_lengths() -> None:
    for case in records.load()["cases"]:
        for row in case["states"]:
            solved, inverse = np.array(row["lengths_solved"]), np.array(row["lengths_inverse"])
            error = 100.0 * (inverse - solved) / solved
            np.testing.assert_allclose(row["error_percent"], error, atol=2e-4)


def test_three_chambers_lengthen_as_a_calculation_by_hand_says() -> None:
    """A bar under p A, fibres that do not yield, the wall pressed together by p / 2 on average.

    St. Venant-Kirchhoff: (stretch^2 - 1) / 2 = p A / (E A_wall stretch) + poisson p / (2 E).
    """
    inner, outer, p = DESIGN.inner_radius**2, DESIGN.outer_radius**2, 0.1
    pull = p * inner / (outer - inner) / DESIGN.wall_modulus
    pressed = DESIGN.wall_poisson * p / 2.0 / DESIGN.wall_modulus
    stretch = max(np.roots([0.5, 0.0, -0.5 - pressed, -pull]).real)
    gaps = DESIGN.rest_length - DESIGN.discs * DESIGN.disc_thickness
    for mesh_name in MESHES:
        solved = records.states(records.load(), mesh_name, "three")[-1]["lengths_solved"][0]
        assert (solved - DESIGN.rest_length) / gaps == pytest.approx(stretch - 1.0, rel=0.03)


def test_the_papers_cases_stay_below_one_percent() -> None:
    for case in records.load()["cases"]:
        if case["case"] in PAPER_CASES:
            assert max(records.worst_error(row) for row in case["states"]) < 1.0


def test_the_section_shows_every_state() -> None:
    text = report.section()
    for case, title in TITLES.items():
        assert text.count(f"| {title} | ") >= len(CASES[case].pressures_bar)
    assert "nan" not in text


def test_a_missing_solver_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    with pytest.raises(SolverFailed, match="apt-get install calculix-ccx"):
        solver.find_solver()


def test_an_unfinished_solution_is_refused(tmp_path: Path) -> None:
    data = tmp_path / "job.dat"
    data.write_text(
        "\n displacements (vx,vy,vz) for set ALL and time  0.2000000E+00\n\n 1 0. 0. 0.\n"
    )
    np.testing.assert_array_equal(read_displacements(data, 1, (0.2,)), np.zeros((1, 1, 3)))
    with pytest.raises(SolverFailed, match=r"at 0\.4 bar"):
        read_displacements(data, 1, (0.2, 0.4))


@pytest.mark.skipif(
    shutil.which("ccx") is None, reason="ccx, the CalculiX solver, is not installed"
)
def test_a_small_arm_is_solved_and_its_solution_kept(tmp_path: Path) -> None:
    mesh = build_mesh(TINY_DESIGN, TINY_MESH)
    deck = write_deck(TINY_DESIGN, mesh, replace(CASES["one"], pressures_bar=(0.1,)))
    data = solver.solve(deck, tmp_path)
    [field] = read_displacements(data, len(mesh.nodes), (0.1,))
    result = compare(TINY_DESIGN, mesh, field)
    assert result.lengths_solved[0] > TINY_DESIGN.rest_length + 0.5
    assert np.abs(result.error_percent).max() < 1.0
    written = data.stat().st_mtime_ns
    assert solver.solve(deck, tmp_path).stat().st_mtime_ns == written


def _bent(mesh: Mesh, shape: Array) -> Array:
    """All nodes on an arc, cross-sections plane and unchanged, plates rigid."""
    s = np.clip(mesh.nodes[:, 2] / DESIGN.rest_length, 0.0, 1.0)
    frames = section_transforms(s[:, None] * shape)
    beside = mesh.nodes - np.stack([0.0 * s, 0.0 * s, s * DESIGN.rest_length], axis=-1)
    return np.asarray(frames[:, :3, 3] + np.einsum("nij,nj->ni", frames[:, :3, :3], beside))
