"""The arm that is solved: its dimensions, its materials, the two meshes and the load cases.

``l0`` and ``d`` are those which table 1 of the paper implies (171.7 mm and 38 mm). The modulus of
the wall is chosen so that a chamber lengthens by about 37 mm/bar in the middle of the range, as the
arm of table 1 does (8.2 mm at 0.2 bar, 22.5 mm at 0.6 bar, 35.0 mm at 1 bar).
"""

from dataclasses import dataclass, replace

#: Pressures of every case, bar: the load is raised through them in one run.
PRESSURES_BAR = (0.2, 0.4, 0.6, 0.8, 1.0)

MPA_PER_BAR = 0.1

#: The load grows by this much (bar) from one increment to the next; the solver may go finer.
INCREMENT_BAR = 0.1


@dataclass(frozen=True)
class Case:
    """What part of the pressure every chamber gets, up to which pressures, and what differs.

    In a real chamber the pressure always acts on the walls. ``walls=False`` loads the caps alone:
    the force then keeps a line of action that leaves the bent chamber. ``discs`` join the chambers.
    """

    shares: tuple[float, float, float]
    walls: bool = True
    discs: int = 5
    pressures_bar: tuple[float, ...] = PRESSURES_BAR


#: The paper's three cases, one away from every plane of symmetry, and two for comparison. With
#: the caps alone the solver finds no equilibrium above 0.94 bar.
CASES = {
    "one": Case((1.0, 0.0, 0.0)),
    "two": Case((0.0, 1.0, 1.0)),
    "three": Case((1.0, 1.0, 1.0)),
    "unequal": Case((1.0, 0.5, 0.0)),
    "one, two discs": Case((1.0, 0.0, 0.0), discs=2),
    "one, caps only": Case((1.0, 0.0, 0.0), walls=False, pressures_bar=PRESSURES_BAR[:4]),
}

#: How the cases are called where people read them.
TITLES = {
    "one": "One chamber",
    "two": "Two chambers",
    "three": "Three chambers",
    "unequal": "1, 0.5 and 0 of the pressure",
    "one, two discs": "One chamber, two discs",
    "one, caps only": "One chamber, caps only",
}

#: The cases that the paper solved, and its largest error: one chamber at 1 bar.
PAPER_CASES = ("one", "two", "three")
PAPER_WORST_PERCENT = 1.6


@dataclass(frozen=True)
class Design:
    """Dimensions (mm) and elastic constants (MPa) of the arm.

    The wall is orthotropic: fibres wound around the chamber make it stiff along the hoop and leave
    it soft along the axis, so that the chamber lengthens under pressure and does not balloon.
    """

    rest_length: float = 171.7
    chamber_offset: float = 38.0
    inner_radius: float = 15.0
    outer_radius: float = 18.0
    rim_radius: float = 22.0
    plate_thickness: float = 8.0
    disc_thickness: float = 2.0
    discs: int = 5
    wall_modulus: float = 0.80
    hoop_modulus: float = 100.0
    wall_shear: float = 0.28
    wall_poisson: float = 0.4
    plate_modulus: float = 2000.0
    plate_poisson: float = 0.35


@dataclass(frozen=True)
class Divisions:
    """Numbers of elements that make one mesh.

    ``around`` a chamber (a multiple of 12), through its wall, from there to the edge of its part of
    a disc, and along the whole arm in the gaps between discs.
    """

    name: str
    around: int
    through_wall: int
    web: int
    along: int


def design_of(case: str) -> Design:
    """The arm that a case is solved with."""
    return replace(Design(), discs=CASES[case].discs)


MESHES = {
    mesh.name: mesh
    for mesh in (
        Divisions("coarse", around=12, through_wall=1, web=1, along=18),
        Divisions("fine", around=24, through_wall=1, web=1, along=30),
    )
}

#: What is solved: every case on the coarse mesh, the paper's three on the fine one.
RUNS = tuple([("coarse", name) for name in CASES] + [("fine", name) for name in PAPER_CASES])
