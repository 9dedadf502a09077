"""Arms that are unlike the controller's model, at rest: rods that are not even along their length.

A section is cut into pieces, each a Cosserat rod of its own stiffness. Pressure acts along the
whole chamber, so a piece of half the stiffness bends and stretches twice as far.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.calibration.hysteresis import play_outputs
from pneuarm.controllers.calibration.plan import Move
from pneuarm.controllers.calibration.recording import Recording
from pneuarm.controllers.kinematics.constant_curvature import shapes_from_lengths
from pneuarm.controllers.kinematics.models.cosserat_rod import (
    CosseratRod,
    RodProperties,
    _Shooting,
    three_springs,
)
from pneuarm.controllers.kinematics.models.rod_integration import SectionRod

_NOISE_M = 1e-4
#: How fast a step rises.
STEP_PA_S = 2e5


@dataclass(frozen=True)
class ForeignArm:
    """An arm of uneven stiffness.

    ``arm`` says what the chambers do without load, with coupling and hysteresis; ``rod`` what the
    body does. ``softness`` is one factor a piece, over the whole arm, base first.
    """

    arm: Arm
    rod: RodProperties
    softness: tuple[float, ...]

    def tips(self, pressures_pa: Array) -> Array:
        """Tip transforms (batch, 4, 4) at rest for acting pressures (batch, n_sections, 3)."""
        own = PressureMap(_unloaded(self.arm)).lengths_m(pressures_pa)
        shapes = shapes_from_lengths(own, self.arm.per_section("chamber_offset_m"))
        pieces = len(self.softness) // self.arm.n_sections
        rests = np.repeat(self.arm.per_section("rest_length_m").reshape(-1), pieces) / pieces
        fine = np.repeat(shapes, pieces, axis=1) / pieces
        softness = np.array(self.softness)
        fine[..., 0] = rests + (fine[..., 0] - rests) * softness
        fine[..., 1:] *= softness[:, None]
        sections = tuple(
            replace(section, rest_length_m=section.rest_length_m / pieces, length_min_m=1e-4)
            for section in self.arm.sections
            for _ in range(pieces)
        )
        rods = _Rods(CosseratRod(self.rod, 6), replace(self.arm, sections=sections), fine)
        rods.softness = softness
        return rods.solve()


class _Rods(_Shooting):
    softness: Array

    def _section(self, index: int, shapes: Array, load: float) -> SectionRod:
        even = super()._section(index, shapes, load)
        soft = float(self.softness[index])
        return replace(
            even,
            compliance_force=soft * even.compliance_force,
            compliance_moment=soft * even.compliance_moment,
        )


def _unloaded(arm: Arm) -> Arm:
    """The same chambers on a body without weight."""
    sections = tuple(
        replace(section, bending_compliance_rad_per_n_m=0.0, axial_compliance_m_per_n=0.0)
        for section in arm.sections
    )
    return replace(arm, sections=sections)


def rod_of(arm: Arm, bend_lost: float) -> RodProperties:
    """Even rod that loses about this share of a bend to its weight, where it hangs."""
    weight_n = arm.mass_kg * max(float(np.linalg.norm(arm.gravity_m_s2)), 1e-9)
    length = arm.total_rest_length_m
    bending = weight_n * length**2 / (12.0 * bend_lost)
    return three_springs(arm.sections[0].chamber_offset_m, bending, arm.mass_kg / length)


def sent_by(moves: Sequence[Move], n_sections: int, sample_s: float = 0.01) -> Array:
    """Pressures (samples, n_sections, 3) of a plan; a step rises by 2 bar/s."""
    start, rows = np.zeros((n_sections, 3)), []
    for move in moves:
        ramp_s = move.ramp_s or float(np.abs(move.pressures_pa - start).max()) / STEP_PA_S
        ramped = Move(move.pressures_pa, max(ramp_s, sample_s), move.rest_s)
        times = np.arange(0.0, ramped.duration_s, sample_s)
        rows += [ramped.at(start, float(time_s)) for time_s in times]
        start = move.pressures_pa
    return np.array(rows)


def recording_of(
    foreign: ForeignArm, sent_pa: Array, sample_s: float, order: Sequence[int] = (0, 1, 2)
) -> Recording:
    """Recording of a foreign arm that is always at rest: ``sent_pa`` (samples, n_sections, 3).

    ``order`` says which valve feeds each chamber of a section.
    """
    rng = np.random.default_rng(0)
    arriving = sent_pa[..., list(order)]
    acting, _ = play_outputs(arriving, foreign.arm.per_section("hysteresis_pa"))
    places, back = np.unique(np.round(acting, 1), axis=0, return_inverse=True)
    tips = foreign.tips(places)[back.reshape(-1)]
    noise = rng.normal(0.0, _NOISE_M, (len(tips), 3))
    measured = sent_pa + rng.normal(0.0, 100.0, sent_pa.shape)
    time_s: Array = sample_s * np.arange(len(sent_pa), dtype=np.float64)
    return Recording(time_s, sent_pa, measured, tips[:, :3, 3] + noise, tips[:, :3, :3])
