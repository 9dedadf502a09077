"""What one tick has come to, as values, and its record: a pure function of them.

The record is made last, for the ring and the log. Nothing reads it back.
"""

from typing import Any, NamedTuple

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.feedback.estimator import EstimateSource, TipEstimate
from pneuarm.controllers.geometry.moving_point import MovingPoint
from pneuarm.controllers.geometry.rotations import quaternion_from_rotation
from pneuarm.controllers.reach.reach import Reach
from pneuarm.controllers.targets.targets import LawName
from pneuarm.hardware.guard import Intervention
from pneuarm.hardware.interface import Measurement
from pneuarm.logs.rings.tick import pack_tick
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.modes.mode import Mode
from pneuarm.service.processes.pipe import SetTarget, SetTipPose


class Heading(NamedTuple):
    """What is known of every tick, even of one that fails; ``compute_s`` is of the one before."""

    sequence: int
    time_unix_ns: int
    wake_latency_s: float
    compute_s: float
    overruns: int
    log_missed: int


class ValveCommand(NamedTuple):
    """Pressures (n_sections, 3) for the guard, or ``vents``: zeros past it.

    ``tip_m`` (3,) is where the law has the tip, None where none was asked.
    """

    pressures_pa: Array
    vents: bool
    tip_m: Array | None = None


class GuardCounts(NamedTuple):
    """What the guard changed in this tick, and in how many ticks it ever did, by kind too."""

    intervention: int = 0
    ticks: int = 0
    by_kind: tuple[int, ...] = (0,) * len(Intervention)

    def after(self, intervention: int) -> "GuardCounts":
        """Return the counts after one more tick."""
        if not intervention:
            return GuardCounts(0, self.ticks, self.by_kind) if self.intervention else self
        pairs = zip(Intervention, self.by_kind, strict=True)
        by_kind = tuple(count + bool(intervention & kind) for kind, count in pairs)
        return GuardCounts(intervention, self.ticks + 1, by_kind)


class Estimate(NamedTuple):
    """Chamber lengths (n_sections, 3) and tip from what was measured.

    ``reference_error_m`` is the tip's distance from the reference, 0 without one.
    """

    lengths_m: Array
    tip: TipEstimate
    reference_error_m: float


class Steered(NamedTuple):
    """How the commanded arm stands: lengths (n_sections, 3), law, goal, reference, correction.

    Positions (3,) and quaternions (4,) are in the base frame, None where there are none. The model
    and the correction are those of :class:`pneuarm.controllers.feedback.observer.TipObserver`.
    """

    lengths_m: Array
    law: LawName
    reach: Reach
    error_m: float
    binding: int
    qp_fallbacks: int
    goal_m: Array | list[float] | None
    goal_quaternion_xyzw: Array | None
    reference: MovingPoint | None
    tip_model_m: Array
    tip_offset_m: Array
    tip_offset_quaternion_xyzw: Array
    tip_poses_refused: int


class Tick(NamedTuple):
    """One tick. In one that failed, what comes after ``guard`` is of the last that did not.

    ``measured_pa`` is None where the reading failed, ``sent_pa`` where even venting did. Ages are
    in seconds. ``estimate`` and ``measurement`` are None before the first reading.
    """

    heading: Heading
    mode: Mode
    active_faults: int
    measured_pa: Array | None
    supply_pa: float
    measurement_age_s: float
    tip_commanded_m: Array | None
    commanded_pa: Array
    sent_pa: Array | None
    guard: GuardCounts
    steered: Steered
    measurement: Measurement | None = None
    estimate: Estimate | None = None
    target: SetTarget | None = None
    target_age_s: float = 0.0
    last_target_sequence: int = 0
    tip_pose: SetTipPose | None = None
    tip_pose_age_s: float = 0.0


def record_of(tick: Tick, tool_m: Array) -> bytes:
    """Record of a tick, see :mod:`pneuarm.logs.rings.tick`; ``tool_m`` (3,) is in the tip frame."""
    return pack_tick(len(tick.commanded_pa), values_of(tick, tool_m))


def values_of(tick: Tick, tool_m: Array) -> dict[str, Any]:
    """Return the value of every field of ``ArmState``, None where an array is not known."""
    heading, guard, steered, estimate = tick.heading, tick.guard, tick.steered, tick.estimate
    target, pose, reference = tick.target, tick.tip_pose, steered.reference
    measured_m, true_m, true_xyzw = _of_sensors(tick.measurement, tool_m)
    tip = _NO_TIP if estimate is None else estimate.tip
    by_range, by_slew, not_finite, too_old, by_supply = guard.by_kind
    return {
        "sequence": heading.sequence,
        "time_unix_ns": heading.time_unix_ns,
        "mode": tick.mode,
        "n_sections": len(tick.commanded_pa),
        "law": steered.law,
        "target_kind": pb.NO_TARGET if target is None else target.target.kind,
        "target_sequence": tick.last_target_sequence,
        "target_age_s": tick.target_age_s,
        "reach": steered.reach,
        "binding_limits": steered.binding,
        "target_error_m": steered.error_m,
        "target_position_m": steered.goal_m,
        "target_orientation_xyzw": steered.goal_quaternion_xyzw,
        "length_commanded_m": steered.lengths_m,
        "length_estimated_m": None if estimate is None else estimate.lengths_m,
        "length_measured_m": measured_m,
        "pressure_commanded_pa": tick.commanded_pa,
        "pressure_sent_pa": tick.sent_pa,
        "pressure_measured_pa": tick.measured_pa,
        "tip_commanded_position_m": tick.tip_commanded_m,
        "tip_estimated_position_m": None if estimate is None else tip.position_m,
        "tip_estimated_orientation_xyzw": (
            None if estimate is None else quaternion_from_rotation(tip.rotation)
        ),
        "tip_estimated_sigma_m": tip.sigma_m,
        "tip_estimated_source": tip.source,
        "tip_measured_position_m": None if pose is None else pose.position_m,
        "tip_measured_orientation_xyzw": None if pose is None else pose.quaternion_xyzw,
        "tip_measured_age_s": tick.tip_pose_age_s,
        "tip_true_position_m": true_m,
        "tip_true_orientation_xyzw": true_xyzw,
        "guard_intervention": guard.intervention,
        "guard_interventions": guard.ticks,
        "guard_range": by_range,
        "guard_slew": by_slew,
        "guard_not_finite": not_finite,
        "guard_too_old": too_old,
        "guard_supply": by_supply,
        "qp_fallbacks": steered.qp_fallbacks,
        "wake_latency_s": heading.wake_latency_s,
        "compute_s": heading.compute_s,
        "overruns": heading.overruns,
        "active_faults": tick.active_faults,
        "supply_pa": tick.supply_pa,
        "measurement_age_s": tick.measurement_age_s,
        "reference_position_m": None if reference is None else reference.position[:3],
        "reference_velocity_m_s": None if reference is None else reference.velocity[:3],
        "reference_error_m": 0.0 if estimate is None else estimate.reference_error_m,
        "tip_model_position_m": steered.tip_model_m,
        "tip_offset_m": steered.tip_offset_m,
        "tip_offset_orientation_xyzw": steered.tip_offset_quaternion_xyzw,
        "tip_poses_refused": steered.tip_poses_refused,
        "log_missed": heading.log_missed,
    }


_NO_TIP = TipEstimate(np.full(3, np.nan), np.eye(3), 0.0, EstimateSource.NONE)


def _of_sensors(
    measurement: Measurement | None, tool_m: Array
) -> tuple[Array | None, Array | None, Array | None]:
    """Return the measured lengths, and the true tip with its tool as position and quaternion."""
    if measurement is None:
        return None, None, None
    if measurement.true_tip is None:
        return measurement.lengths_m, None, None
    position_m, rotation = measurement.true_tip
    true_m = position_m + rotation @ tool_m
    return measurement.lengths_m, true_m, quaternion_from_rotation(rotation)
