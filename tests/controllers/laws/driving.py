"""Driving a controller in the tests, with an eye on every limit at every tick."""

from collections.abc import Iterator

import numpy as np
import pytest

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.arm.arm import Arm, Array, KeepOut, Sphere
from pneuarm.controllers.controller import Controller
from pneuarm.controllers.kinematics.constant_curvature import (
    section_end_transforms,
    section_transforms,
    shapes_from_lengths,
    tip_transform,
)
from pneuarm.controllers.laws.settings import ControlSettings
from pneuarm.controllers.reach.reach import Reach
from pneuarm.controllers.targets.targets import LawName, PositionTarget, Target
from tools.rig.arms import ARMS

DT_S = 0.005
SETTINGS = ControlSettings()

every_arm = pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
every_law = pytest.mark.parametrize(
    "law", [LawName.RESOLVED_RATE, LawName.QP_IK], ids=lambda law: law.name
)


def starting_at(arm: Arm, lengths: Array) -> Controller:
    """Controller that commands the lengths now."""
    controller = Controller(arm, SETTINGS)
    controller.start_from(PressureMap(arm).pressures_pa(lengths))
    return controller


def position_of(arm: Arm, lengths: Array, law: LawName) -> PositionTarget:
    """Where the tip is with the lengths, as a target."""
    return PositionTarget(tip_transform(arm, lengths)[:3, 3], law)


def path(arm: Arm, controller: Controller, target: Target, seconds: float) -> Iterator[Array]:
    """Commanded lengths tick by tick until the target is reached or given up."""
    controller.set_target(target)
    for _ in range(round(seconds / DT_S)):
        controller.step(DT_S)
        yield controller.lengths_m.copy()
        if controller.reach in (Reach.REACHED, Reach.OUT_OF_REACH):
            return


def assert_within_limits(
    arm: Arm, before: Array, after: Array, rates: Array | None = None
) -> Array:
    """Check every limit since the tick before; return the rates now (n_sections, 3).

    Eq. (4) strictly, bend, pressure, its slew, keep-outs, rate; acceleration from ``rates`` on.
    """
    assert np.isfinite(after).all()
    assert (after > arm.per_chamber("length_min_m")).all()
    assert (after < arm.per_chamber("length_max_m")).all()
    shapes = shapes_from_lengths(after, arm.per_section("chamber_offset_m"))
    theta = np.hypot(shapes[:, 1], shapes[:, 2])
    assert (theta <= arm.per_section("bend_max_rad")[:, 0] + 1e-12).all()
    largest = arm.per_chamber("length_rate_max_m_s") * DT_S
    assert (np.abs(after - before) <= largest * (1.0 + 1e-9)).all()
    pressures = [PressureMap(arm).pressures_pa(lengths) for lengths in (before, after)]
    slew = np.abs(pressures[1] - pressures[0]) / DT_S
    assert (slew <= arm.per_chamber("pressure_slew_max_pa_s") * (1.0 + 1e-9)).all()
    assert (pressures[1] >= arm.per_chamber("pressure_min_pa") - 1e-6).all()
    assert (pressures[1] <= arm.per_chamber("pressure_max_pa") + 1e-6).all()
    for place in arm.keep_outs:
        assert clearance_m(arm, after, place) >= 0.0
    now: Array = (after - before) / DT_S
    if rates is not None:
        most = arm.per_chamber("length_acceleration_max_m_s2") * DT_S
        assert (np.abs(now - rates) <= most + 1e-9).all()
    return now


def clearance_m(arm: Arm, lengths: Array, place: KeepOut) -> float:
    """Distance of the arm's skin from a keep-out, from many points and no chords."""
    ends = section_end_transforms(arm, lengths)
    shapes = shapes_from_lengths(lengths, arm.per_section("chamber_offset_m"))
    points, start = [], np.eye(4)
    for shape, end in zip(shapes, ends, strict=True):
        parts = section_transforms(np.linspace(0.0, 1.0, 200)[:, None] * shape)
        points.append((start @ parts)[:, :3, 3])
        start = end
    body = np.concatenate(points)
    if isinstance(place, Sphere):
        distances = np.linalg.norm(body - place.center_m, axis=1) - place.radius_m
    else:
        distances = place.offset_m - body @ np.array(place.normal)
    return float(distances.min()) - arm.body_radius_m


def run(arm: Arm, controller: Controller, target: Target, seconds: float = 8.0) -> None:
    """Follow a target; no tick may leave a limit."""
    before, rates = controller.lengths_m.copy(), controller._chambers.rates_m_s
    for lengths in path(arm, controller, target, seconds):
        rates = assert_within_limits(arm, before, lengths, rates)
        before = lengths
