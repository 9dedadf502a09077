"""The input file of CalculiX: mesh, materials, supports and the steps of the load."""

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from tools.validation.finite_elements.design import INCREMENT_BAR, MPA_PER_BAR, Case, Design
from tools.validation.finite_elements.mesh import BOTTOM, INWARD, TOP, Mesh


def write_deck(design: Design, mesh: Mesh, case: Case) -> str:
    """Text of the deck that raises the load through the case's pressures, in one step."""
    lines = ["*HEADING", "Three fibre-reinforced chambers between two plates; mm, N, MPa"]
    lines += _mesh_lines(mesh)
    lines += _material_lines(design)
    lines += ["*BOUNDARY", "BASE,1,3"]
    lines += ["*TIME POINTS, NAME=PRESSURES", *(f"{bar:g}" for bar in case.pressures_bar)]
    lines += _step_lines(case)
    return "\n".join(lines) + "\n"


def _mesh_lines(mesh: Mesh) -> Iterator[str]:
    yield "*NODE, NSET=ALL"
    for number, (x, y, z) in enumerate(mesh.nodes, start=1):
        yield f"{number},{x:.9g},{y:.9g},{z:.9g}"
    for part, elements in mesh.parts.items():
        yield f"*ELEMENT, TYPE=C3D20R, ELSET={part}"
        for element in elements:
            yield from _number_lines([element, *mesh.hexes[element]])
    yield "*NSET, NSET=BASE"
    yield from _number_lines(mesh.base_nodes)
    for chamber, faces in enumerate(mesh.pressed, start=1):
        for elements, face in faces:
            yield f"*ELSET, ELSET=BORE{chamber}F{face}"
            yield from _number_lines(elements)


def _number_lines(indices: Iterable[int] | NDArray[np.int64]) -> Iterator[str]:
    """Number from one, at most ten to a line, a comma at the end where the list goes on."""
    numbers = [str(index + 1) for index in indices]
    rows = [",".join(numbers[at : at + 10]) for at in range(0, len(numbers), 10)]
    yield from (row + "," for row in rows[:-1])
    yield rows[-1]


def _material_lines(design: Design) -> Iterator[str]:
    """An isotropic plate, and a wall in the directions radial, hoop and axial (1, 2, 3)."""
    soft, hoop, shear = design.wall_modulus, design.hoop_modulus, design.wall_shear
    across = design.wall_poisson * soft / hoop
    yield from ["*MATERIAL, NAME=PLATE", "*ELASTIC"]
    yield f"{design.plate_modulus:g},{design.plate_poisson:g}"
    yield from ["*MATERIAL, NAME=WALL", "*ELASTIC, TYPE=ENGINEERING CONSTANTS"]
    yield (
        f"{soft:g},{hoop:g},{soft:g},{across:g},{design.wall_poisson:g},"
        f"{design.wall_poisson:g},{shear:g},{shear:g},"
    )
    yield f"{shear:g},293"
    yield "*SOLID SECTION, ELSET=STIFF, MATERIAL=PLATE"
    for chamber in range(3):
        angle = 2.0 * np.pi * chamber / 3.0
        x, y = design.chamber_offset * np.cos(angle), design.chamber_offset * np.sin(angle)
        at = f"{x:.9g},{y:.9g}"
        yield f"*ORIENTATION, NAME=AXIS{chamber + 1}, SYSTEM=CYLINDRICAL"
        yield f"{at},0,{at},1"
        yield (
            f"*SOLID SECTION, ELSET=WALL{chamber + 1}, MATERIAL=WALL, ORIENTATION=AXIS{chamber + 1}"
        )


def _step_lines(case: Case) -> Iterator[str]:
    """One step in which the solver's time is the pressure in bar; displacements of all nodes."""
    last = case.pressures_bar[-1]
    yield "*STEP, NLGEOM, INC=500"
    yield from ["*STATIC", f"{INCREMENT_BAR:g},{last:g},1e-5,{INCREMENT_BAR:g}", "*DLOAD"]
    faces = (BOTTOM, TOP, INWARD) if case.walls else (BOTTOM, TOP)
    for chamber, share in enumerate(case.shares, start=1):
        if share > 0.0:
            pressure = share * last * MPA_PER_BAR
            yield from (f"BORE{chamber}F{face},P{face},{pressure:.9g}" for face in faces)
    yield from ["*NODE PRINT, NSET=ALL, TIME POINTS=PRESSURES", "U", "*END STEP"]
