"""Both laws on every arm: they arrive, and never leave a limit on the way."""

from collections.abc import Callable

import numpy as np
import pytest

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.controller import Controller
from pneuarm.controllers.kinematics.constant_curvature import tip_transform
from pneuarm.controllers.laws.solve_ik import IkSolver
from pneuarm.controllers.reach.reach import Reach
from pneuarm.controllers.targets.targets import LawName, LengthsTarget, PositionTarget
from tests.controllers.laws.driving import (
    SETTINGS,
    every_arm,
    every_law,
    path,
    position_of,
    run,
    starting_at,
)
from tools.rig.arms import paper_arm, random_lengths, trunk_arm


@every_arm
@every_law
def test_random_reachable_positions_are_reached_inside_every_limit(arm: Arm, law: LawName) -> None:
    rng = np.random.default_rng(10)
    controller = Controller(arm, SETTINGS)
    for _ in range(12):
        # The damped law may stick along the limits of the trunk: that is what the QP is for.
        share = 0.9 if law == LawName.RESOLVED_RATE else 1.0
        controller.start_from(PressureMap(arm).pressures_pa(random_lengths(arm, rng, share)))
        target = position_of(arm, random_lengths(arm, rng, share), law)
        run(arm, controller, target)
        assert controller.reach == Reach.REACHED
        tip = tip_transform(arm, controller.lengths_m)[:3, 3]
        distance = np.linalg.norm(tip - target.position_m)
        assert distance <= SETTINGS.reached_tolerance_m
        assert controller.error_m == pytest.approx(distance, abs=1e-12)
    assert controller.fallbacks == 0


@every_law
@pytest.mark.parametrize("make", [paper_arm, trunk_arm])
def test_from_exactly_straight_every_direction_is_open(
    make: Callable[[], Arm], law: LawName
) -> None:
    arm = make()
    rng = np.random.default_rng(11)
    for _ in range(3):
        controller = starting_at(arm, arm.rest_lengths_m)
        run(arm, controller, position_of(arm, random_lengths(arm, rng, 0.8), law))
        assert controller.reach == Reach.REACHED


@every_law
def test_a_straight_arm_lengthens_without_bending(law: LawName) -> None:
    arm = paper_arm()
    controller = starting_at(arm, arm.rest_lengths_m)
    run(arm, controller, PositionTarget(np.array([0.0, 0.0, 0.27]), law))
    assert controller.reach == Reach.REACHED
    assert np.ptp(controller.lengths_m) < 1e-6


@every_arm
@every_law
@pytest.mark.parametrize("end", ["length_min_m", "length_max_m"])
def test_lengths_at_the_ends_of_eq_4_are_never_quite_commanded(
    arm: Arm, law: LawName, end: str
) -> None:
    controller = starting_at(arm, arm.rest_lengths_m)
    run(arm, controller, LengthsTarget(arm.per_chamber(end), law))
    assert (controller.lengths_m != arm.per_chamber(end)).all()


@every_arm
@every_law
def test_the_same_inputs_from_the_same_start_give_the_same_bits(arm: Arm, law: LawName) -> None:
    def trajectory() -> Array:
        rng = np.random.default_rng(14)
        controller = starting_at(arm, random_lengths(arm, rng))
        lengths = []
        for _ in range(3):
            target = position_of(arm, random_lengths(arm, rng), law)
            lengths += list(path(arm, controller, target, 0.4))
        return np.array(lengths)

    np.testing.assert_array_equal(trajectory(), trajectory())


@pytest.mark.parametrize("every", [1, 3])
def test_where_the_solver_gives_nothing_the_damped_law_goes_on_and_it_is_counted(
    every: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    arm = paper_arm()
    calls, solve = 0, IkSolver.solve

    def failing(self: IkSolver, problem: object) -> Array | None:
        nonlocal calls
        calls += 1
        return None if calls % every == 0 else solve(self, problem)  # type: ignore[arg-type]

    monkeypatch.setattr(IkSolver, "solve", failing)
    rng = np.random.default_rng(15)
    controller = starting_at(arm, random_lengths(arm, rng))
    run(arm, controller, position_of(arm, random_lengths(arm, rng), LawName.QP_IK))
    assert controller.reach == Reach.REACHED
    assert calls > 10
    assert controller.fallbacks == calls // every
