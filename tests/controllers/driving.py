"""Driving a controller in the tests, with an eye on every limit at every tick."""

from collections.abc import Iterator

import numpy as np
import pytest

from controllers.actuation import PressureMap
from controllers.arm import Arm, Array
from controllers.controller import Controller, Reach
from controllers.kinematics.constant_curvature import shapes_from_lengths, tip_transform
from controllers.settings import ControlSettings
from controllers.targets import LawName, PositionTarget, Target
from tests.arms import ARMS

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


def assert_within_limits(arm: Arm, before: Array, after: Array) -> None:
    """Eq. (4) strictly, the bend, and the rate since the tick before."""
    assert np.isfinite(after).all()
    assert (after > arm.per_chamber("length_min_m")).all()
    assert (after < arm.per_chamber("length_max_m")).all()
    shapes = shapes_from_lengths(after, arm.per_section("chamber_offset_m"))
    theta = np.hypot(shapes[:, 1], shapes[:, 2])
    assert (theta <= arm.per_section("bend_max_rad")[:, 0] + 1e-12).all()
    largest = arm.per_chamber("length_rate_max_m_s") * DT_S
    assert (np.abs(after - before) <= largest * (1.0 + 1e-9)).all()


def run(arm: Arm, controller: Controller, target: Target, seconds: float = 8.0) -> None:
    """Follow a target; no tick may leave a limit."""
    before = controller.lengths_m.copy()
    for lengths in path(arm, controller, target, seconds):
        assert_within_limits(arm, before, lengths)
        before = lengths
