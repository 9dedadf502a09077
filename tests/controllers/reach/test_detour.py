"""The way round ends no farther from a target than the way straight on."""

import numpy as np
from scipy.optimize import minimize

from pneuarm.controllers.actuation.pressure_map import PressureMap, length_bounds_m
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.kinematics.constant_curvature import tip_transform
from pneuarm.controllers.reach.reach import Reach
from pneuarm.controllers.targets.targets import PositionTarget
from tests.controllers.calibration.synthetic import other_arm
from tests.controllers.laws.driving import path, starting_at
from tools.rig.arms import table1_arm

#: Pressures of a coarse search, each between its limits.
GRID = np.linspace(0.0, 1.0, 7)


def distance_m(arm: Arm, lengths_m: Array, position_m: Array) -> float:
    return float(np.linalg.norm(tip_transform(arm, lengths_m)[:3, 3] - position_m))


def nearest_in_pressures_m(arm: Arm, position_m: Array) -> float:
    """Distance of the nearest tip that some pressures give: a grid, then from its best places."""
    low, high = (arm.per_chamber(f"pressure_{end}_pa").reshape(-1) for end in ("min", "max"))
    pressure_map = PressureMap(arm)

    def error_m(share: Array) -> float:
        lengths = pressure_map.lengths_m((low + share * (high - low)).reshape(1, 3))
        return distance_m(arm, lengths, position_m)

    grid = np.stack(np.meshgrid(GRID, GRID, GRID), axis=-1).reshape(-1, 3)
    best = grid[np.argsort([error_m(share) for share in grid])[:3]]
    bounds = [(0.0, 1.0)] * 3
    return min(float(minimize(error_m, share, bounds=bounds).fun) for share in best)


def nearest_in_box(arm: Arm, position_m: Array) -> Array:
    """Lengths (1, 3) nearest to a position between the bounds of the lengths alone."""
    low, high = (bound.reshape(-1) for bound in length_bounds_m(arm))

    def error_m(share: Array) -> float:
        lengths = (low + share * (high - low)).reshape(1, 3)
        return distance_m(arm, lengths, position_m)

    found = min(
        (minimize(error_m, np.full(3, start), bounds=[(0.0, 1.0)] * 3) for start in (0.2, 0.5)),
        key=lambda result: float(result.fun),
    )
    nearest: Array = (low + found.x * (high - low)).reshape(1, 3)
    return nearest


def test_a_calibrated_arm_comes_as_near_as_its_pressures_let_it() -> None:
    arm = other_arm(table1_arm())  # no vacuum: no chamber gets shorter than it hangs
    hanging = PressureMap(arm).lengths_m(np.zeros((1, 3)))
    vented = tip_transform(arm, hanging)[:3, 3]
    rng = np.random.default_rng(4)
    for angle in rng.uniform(0.0, 2.0 * np.pi, 6):
        position = vented + 0.025 * np.array([np.cos(angle), np.sin(angle), -0.4])
        controller = starting_at(arm, hanging)
        target = PositionTarget(position, nearest_lengths_m=nearest_in_box(arm, position))
        *_, last = path(arm, controller, target, 3.0)
        assert controller.reach == Reach.OUT_OF_REACH
        best_m = nearest_in_pressures_m(arm, position)
        assert distance_m(arm, last, position) < best_m + 2e-4
