"""The arm as a MuJoCo model: straight links with springs between them, and what they may touch.

A section is a chain of equal links. Each turns on a ball joint at its near end and stretches along
a slide of its own; a last ball joint carries the plate. A ball joint also twists, as stiffly as it
bends: a tube's torsional stiffness is near its bending stiffness.
"""

from math import sqrt

import mujoco
import numpy as np

from pneuarm.controllers.arm.arm import CHAMBER_ANGLES_RAD, Arm, Array, KeepOut, Sphere
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.hardware.simulator.parameters import SimulatorParameters

#: Degrees of freedom of a link: three of its turn, one of its slide. A plate has a turn alone.
LINK_DOFS, TURN_DOFS = 4, 3

#: The skin of an arm that says no ``body_radius_m``: the backbone itself touches.
_THINNEST_M = 1e-3

#: Time constant (s) and damping ratio of a contact: a push of the arm sinks in less than 1 mm.
_CONTACT = (0.005, 1.0)


def turn_shares(links: int) -> Array:
    """Share of a section's bend that each of its joints takes, (links + 1,), for an even number.

    Two links that turn by ``w``, ``1 - 2 w`` and ``w`` of an arc's angle ``a`` span a chord of
    ``1 - (1 - 2 w)^2 a^2 / 8`` of their length, the arc one of ``1 - a^2 / 24``: with
    ``(1 - 2 w)^2 = 1/3`` a section that bends evenly ends where its arc does, up to ``a^4``.
    """
    if links < 2 or links % 2:
        raise InvalidInput(f"segments_per_section = {links}: MuJoCo's arm takes 2 or more, even")
    middle = 1.0 / sqrt(3.0)
    shares = np.zeros(links + 1)
    shares[1::2] = middle
    shares[:-1:2] += 0.5 * (1.0 - middle)
    shares[2::2] += 0.5 * (1.0 - middle)
    return shares / (links // 2)


def compiled(arm: Arm, values: SimulatorParameters, places: tuple[KeepOut, ...]) -> mujoco.MjModel:
    """Return the model with springs for a bending stiffness EI of 1 N m^2 in every section.

    ``places`` are solid: the arm is pushed out of them.
    """
    spec = mujoco.MjSpec()
    spec.modelname = arm.name
    spec.option.gravity = arm.gravity_m_s2
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for place in places:
        _add_place(spec, place)
    _add_sections(spec, arm, values)
    return spec.compile()


def _add_place(spec: mujoco.MjSpec, place: KeepOut) -> None:
    """Add a ball, or a plane without end whose free side is against its normal."""
    solid = spec.worldbody.add_geom(contype=0, conaffinity=1, solref=_CONTACT)
    if isinstance(place, Sphere):
        solid.type = mujoco.mjtGeom.mjGEOM_SPHERE
        solid.pos, solid.size = place.center_m, [place.radius_m, 0.0, 0.0]
        return
    normal = np.array(place.normal)
    solid.type = mujoco.mjtGeom.mjGEOM_PLANE
    solid.pos, solid.size = place.offset_m * normal, [0.0, 0.0, 1.0]
    solid.alt.type = mujoco.mjtOrientation.mjORIENTATION_ZAXIS
    solid.alt.zaxis = -normal


def _add_sections(spec: mujoco.MjSpec, arm: Arm, values: SimulatorParameters) -> None:
    parent, links = spec.worldbody, values.segments_per_section
    radius_m = max(arm.body_radius_m, _THINNEST_M)
    for index, section in enumerate(arm.sections):
        length = section.rest_length_m / links
        turns = 1.0 / (section.rest_length_m * turn_shares(links))
        axial = 2.0 * values.axial_stiffness_ratio / (section.chamber_offset_m**2 * length)
        mass = values.mass_per_length_kg_m * length
        for link in range(links):
            parent = parent.add_body(name=f"link_{index}_{link}", pos=[0, 0, length * bool(link)])
            parent.add_joint(type=mujoco.mjtJoint.mjJNT_BALL, stiffness=turns[link])
            parent.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1], stiffness=axial)
            _weigh(parent, mass, values.gyration_radius_m, length)
            parent.add_geom(
                type=mujoco.mjtGeom.mjGEOM_CAPSULE,
                fromto=[0.0, 0.0, 0.0, 0.0, 0.0, length],
                size=[radius_m, 0.0, 0.0],
                solref=_CONTACT,
                contype=1,  # touches the places, whose `conaffinity` is 1, and nothing of its own
                conaffinity=0,
            )
        parent = parent.add_body(name=f"plate_{index}", pos=[0, 0, length])
        parent.add_joint(type=mujoco.mjtJoint.mjJNT_BALL, stiffness=turns[links])
        _weigh(parent, values.plate_mass_kg, values.gyration_radius_m, 0.0)


def _weigh(body: mujoco.MjsBody, mass: float, gyration_radius_m: float, length: float) -> None:
    """Give a body the inertia of an even rod of some thickness that begins at its joint."""
    about_axis = mass * gyration_radius_m**2
    across = about_axis + mass * length**2 / 12.0
    body.explicitinertial = True
    body.mass, body.ipos = mass, [0.0, 0.0, 0.5 * length]
    body.inertia = [across, across, about_axis]


def force_per_lengthening(arm: Arm, nominal: SimulatorParameters, bending_n_m2: float) -> Array:
    """Forces on every degree of freedom (n_dofs, n_chambers) by which a chamber lengthens by 1 m.

    A chamber's pressure acts along the whole of it: a moment and an axial force, the same at every
    joint of its section, in the frame of the link.
    """
    links = nominal.segments_per_section
    rows = links * LINK_DOFS + TURN_DOFS
    forces = np.zeros((arm.n_sections * rows, arm.n_chambers))
    for index, section in enumerate(arm.sections):
        offset = section.chamber_offset_m
        per_metre = bending_n_m2 / section.rest_length_m
        moment = 2.0 * per_metre / (3.0 * offset)
        axial = 2.0 * nominal.axial_stiffness_ratio * per_metre / (3.0 * offset**2)
        link = moment * np.array(
            [
                np.sin(CHAMBER_ANGLES_RAD),
                -np.cos(CHAMBER_ANGLES_RAD),
                np.zeros(3),
                np.full(3, axial / moment),
            ]
        )
        block = forces[rows * index : rows * (index + 1), 3 * index : 3 * index + 3]
        block[:-TURN_DOFS] = np.tile(link, (links, 1))
        block[-TURN_DOFS:] = link[:TURN_DOFS]
    return forces
