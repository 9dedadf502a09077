"""The campaign behind the figures of reach: many targets, every limit watched at every step.

    .venv/bin/python -m tools.bench.ik --reach --json

Steps of 10 ms instead of 1 ms: the same laws and the same checks, in a tenth of the time. The whole
campaign is drawn from one seed.
"""

import sys
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize

from pneuarm.controllers.actuation.pressure_map import PressureMap, length_bounds_m
from pneuarm.controllers.arm.arm import Arm, Array, Sphere
from pneuarm.controllers.controller import Controller
from pneuarm.controllers.kinematics.constant_curvature import shapes_from_lengths, tip_transform
from pneuarm.controllers.laws.settings import ControlSettings
from pneuarm.controllers.limits.keep_out import KeepOutLimit
from pneuarm.controllers.reach.reach import Reach
from pneuarm.controllers.targets.targets import PositionTarget
from pneuarm.controllers.workspace.workspace import Workspace
from tools.rig.arms import paper_arm, random_lengths, trunk_arm

DT_S = 0.01
TOLERANCE_M = 1e-4
SETTINGS = ControlSettings(reached_tolerance_m=5e-5, settled_time_s=0.02)
_MOST_STEPS = 1000


class Watch:
    """Counts steps that leave a limit: length, bend, pressure, its slew, rate, acceleration.

    Steps are looked at in blocks: one by one the looking would take longer than the steps.
    """

    _BLOCK = 5000

    def __init__(self, arm: Arm) -> None:
        self._arm, self._keep_out, self._map = arm, KeepOutLimit(arm), PressureMap(arm)
        self._violations = self.steps = 0
        self._touched: set[str] = set()
        self._rows: list[tuple[Array, Array, Array]] = []

    def start(self, controller: Controller) -> None:
        """Begin anew from where a controller stands."""
        self._lengths, self._rates = controller.lengths_m, np.zeros_like(controller.lengths_m)

    def see(self, lengths: Array) -> None:
        """Take one step."""
        self._rows.append((lengths, self._lengths, self._rates))
        self._rates = (lengths - self._lengths) / DT_S
        self._lengths = lengths
        self.steps += 1
        if len(self._rows) == self._BLOCK:
            self._look()

    @property
    def violations(self) -> int:
        """Steps that left a limit."""
        self._look()
        return self._violations

    @property
    def touched(self) -> set[str]:
        """Limits that were met."""
        self._look()
        return self._touched

    def _look(self) -> None:
        if not self._rows:
            return
        lengths, before, rates_before = (
            np.array(column) for column in zip(*self._rows, strict=True)
        )
        self._rows.clear()
        left = self._left(lengths, before, rates_before)
        self._violations += int((np.min(list(left.values()), axis=0) < 0.0).sum())
        near = {"length": 2e-5, "bend": 2e-5, "pressure": 2e-5, "keep_out": 3e-4}
        self._touched |= {
            name for name, value in left.items() if value.min() < near.get(name, 1e-2)
        }

    def _left(self, lengths: Array, before: Array, rates_before: Array) -> dict[str, Array]:
        """What is left of every limit at every step (steps,)."""
        arm, rates = self._arm, (lengths - before) / DT_S
        pressures = self._map.pressures_pa(lengths)
        slew = np.abs(pressures - self._map.pressures_pa(before)) / DT_S
        change = np.abs(rates - rates_before) / DT_S
        shapes = shapes_from_lengths(lengths, arm.per_section("chamber_offset_m"))
        bend = np.hypot(shapes[..., 1], shapes[..., 2])
        free_bend = arm.per_section("chamber_offset_m")[:, 0] * (
            arm.per_section("bend_max_rad")[:, 0] - bend
        )

        def least(values: Array) -> Array:
            return np.asarray(values.reshape(len(lengths), -1).min(axis=1))

        left = {
            "length": least(
                np.minimum(
                    lengths - arm.per_chamber("length_min_m"),
                    arm.per_chamber("length_max_m") - lengths,
                )
            ),
            "bend": least(free_bend) + 1e-13,
            "pressure": 1e-6
            * least(
                np.minimum(
                    pressures - arm.per_chamber("pressure_min_pa"),
                    arm.per_chamber("pressure_max_pa") - pressures,
                )
                + 1e-6
            ),
            "slew": least(1.0 - slew / arm.per_chamber("pressure_slew_max_pa_s")) + 1e-9,
            "rate": least(1.0 - np.abs(rates) / arm.per_chamber("length_rate_max_m_s")) + 1e-9,
            "acceleration": least(1.0 - change / arm.per_chamber("length_acceleration_max_m_s2"))
            + 1e-7,
        }
        if arm.keep_outs:
            keep_out = self._keep_out
            left["keep_out"] = np.array([keep_out.left_m(row).min() for row in lengths]) + 1e-13
        return left


def follow(controller: Controller, target: PositionTarget, watch: Watch) -> int:
    """Follow a target to its end; the number of steps."""
    controller.set_target(target)
    for step in range(1, _MOST_STEPS + 1):
        controller.step(DT_S)
        watch.see(controller.lengths_m)
        if controller.reach in (Reach.REACHED, Reach.OUT_OF_REACH):
            return step
    return _MOST_STEPS


def place(controller: Controller, arm: Arm, lengths: Array, watch: Watch) -> None:
    """Stand at some lengths."""
    controller.start_from(PressureMap(arm).pressures_pa(lengths))
    watch.start(controller)


def reachable(arm: Arm, number: int, seed: int, around_straight: bool = False) -> dict[str, object]:
    """Random reachable positions from random starts; or both at and around the straight arm."""
    rng, controller, watch = np.random.default_rng(seed), Controller(arm, SETTINGS), Watch(arm)
    reached, steps, worst_m = 0, [], 0.0

    def lengths() -> Array:
        if not around_straight:
            return random_lengths(arm, rng)
        size = 10.0 ** rng.uniform(-12, -2) * (rng.random() < 0.8)
        low, high = length_bounds_m(arm)
        mean = rng.uniform(low.max() + 0.011, high.min() - 0.011)
        return np.asarray(mean + size * rng.uniform(-1.0, 1.0, (arm.n_sections, 3)))

    for count in range(number):
        place(controller, arm, lengths(), watch)
        target = PositionTarget(tip_transform(arm, lengths())[:3, 3])
        steps.append(follow(controller, target, watch))
        tip = tip_transform(arm, controller.lengths_m)[:3, 3]
        error = float(np.linalg.norm(tip - target.position_m))
        reached += error <= TOLERANCE_M
        worst_m = max(worst_m, error)
        progress(f"reachable, {arm.name}", count, number)
    return {
        "targets": number,
        "reached": reached,
        "worst_error_mm": 1e3 * worst_m,
        "steps_median": float(np.median(steps)),
        "steps_worst": int(max(steps)),
        "violations": watch.violations,
        "steps": watch.steps,
        "fallbacks": controller.fallbacks,
    }


def out_of_reach(arm: Arm, number: int, seed: int) -> dict[str, object]:
    """Random positions that one section cannot reach, against an independent search."""
    rng, controller, watch = np.random.default_rng(seed), Controller(arm, SETTINGS), Watch(arm)
    workspace, search = Workspace(arm), GlobalSearch(arm)
    excess, said, count = [], 0, 0
    while count < number:
        position = rng.uniform(-1.5, 1.5, 3) * arm.max_length_m
        if workspace.contains(position):
            continue
        nearest = workspace.lengths_m(workspace.is_reachable(position).nearest_m)
        place(controller, arm, random_lengths(arm, rng), watch)
        follow(controller, PositionTarget(position, nearest_lengths_m=nearest), watch)
        said += controller.reach == Reach.OUT_OF_REACH and bool(controller.binding())
        tip = tip_transform(arm, controller.lengths_m)[:3, 3]
        excess.append(float(np.linalg.norm(tip - position)) - search.distance_m(position))
        progress(f"out of reach, {arm.name}", count, number)
        count += 1
    return {
        "targets": number,
        "within_tolerance": sum(value <= TOLERANCE_M for value in excess),
        "worst_excess_mm": 1e3 * max(excess),
        "said_so": said,
        "violations": watch.violations,
    }


class GlobalSearch:
    """The distance of a position from the workspace of one section, by a search of its own.

    A grid over the lengths gives starts, SLSQP follows the best of them. It shares nothing with
    the workspace's search over the boundary's sheets.
    """

    def __init__(self, arm: Arm) -> None:
        self._arm = arm
        low, high = (bound[0] for bound in length_bounds_m(arm))
        self._bounds = list(zip(low, high, strict=True))
        axes = [np.linspace(a, b, 25) for a, b in self._bounds]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 1, 3)
        self._d, self._bend = arm.sections[0].chamber_offset_m, arm.sections[0].bend_max_rad
        self._grid = grid[self._left(grid) >= 0.0]
        self._tips = tip_transform(arm, self._grid)[:, :3, 3]

    def _left(self, lengths: Array) -> Array:
        shapes = shapes_from_lengths(lengths.reshape(-1, 3), self._d)
        left: Array = self._bend - np.hypot(shapes[:, 1], shapes[:, 2])
        return left

    def distance_m(self, position_m: Array) -> float:
        distances = np.linalg.norm(self._tips - position_m, axis=1)
        starts = [int(distances.argmin())]
        for index in distances.argsort()[:400]:  # and some that are elsewhere
            away = np.abs(self._grid[index] - self._grid[starts]).max(axis=(1, 2))
            if len(starts) < 6 and away.min() > 0.03:
                starts.append(int(index))
        return min([float(distances.min()), *(self._refined(position_m, k) for k in starts)])

    def _refined(self, position_m: Array, start: int) -> float:
        found = minimize(
            lambda x: 10.0 * float(np.linalg.norm(self._tip(x) - position_m)),
            self._grid[start].reshape(-1),
            method="SLSQP",
            bounds=self._bounds,
            constraints=[{"type": "ineq", "fun": lambda x: self._left(x)}],
            options={"ftol": 1e-12, "maxiter": 200},
        )
        inside = found.x is not None and self._left(found.x)[0] >= -1e-9
        return float(np.linalg.norm(self._tip(found.x) - position_m)) if inside else np.inf

    def _tip(self, lengths: Array) -> Array:
        tip: Array = tip_transform(self._arm, lengths.reshape(1, 3))[:3, 3]
        return tip


def acceptance(arm: Arm, ticks: int, seed: int) -> dict[str, object]:
    """Share of usable results of OSQP along wild motions, with every limit there is touched."""
    reach = arm.total_rest_length_m
    ball = Sphere((0.6 * reach, 0.0, 0.8 * reach), 0.15 * reach)
    section = replace(
        arm.sections[0], pressure_slew_max_pa_s=1.2e5, pressure_max_pa=0.5e5, bend_max_rad=1.2
    )
    arm = replace(arm, keep_outs=(ball,), body_radius_m=0.02, sections=(section, *arm.sections[1:]))
    rng, controller, watch = np.random.default_rng(seed), Controller(arm, SETTINGS), Watch(arm)
    place(controller, arm, arm.rest_lengths_m, watch)
    solver = controller._chambers.qp_ik._solver
    for tick in range(ticks):
        if tick % 60 == 0:
            far = 1.2 * arm.max_length_m * rng.uniform(-1.0, 1.0, 3)
            far = far if tick % 120 else np.array(ball.center_m) + 0.02 * rng.standard_normal(3)
            controller.set_target(PositionTarget(far))
        controller.step(DT_S)
        watch.see(controller.lengths_m)
        progress(f"acceptance, {arm.name}", tick, ticks)
    return {
        "ticks": ticks,
        "asked": solver.asked,
        "accepted": 1.0 - controller.fallbacks / max(solver.asked, 1),
        "touched": sorted(watch.touched),
        "violations": watch.violations,
    }


def progress(what: str, count: int, number: int) -> None:
    """One line on stderr now and then."""
    if (count + 1) % max(number // 10, 1) == 0:
        print(f"{what}: {count + 1} of {number}", file=sys.stderr, flush=True)


def campaign(share: float) -> dict[str, object]:
    """The whole campaign, or a share of it."""

    def scaled(number: int) -> int:
        return max(1, round(share * number))

    paper, trunk = paper_arm(), trunk_arm()
    return {
        "step_ms": 1e3 * DT_S,
        "accepted_one_section": acceptance(paper, scaled(50_000), 1),
        "accepted_three_sections": acceptance(trunk, scaled(50_000), 2),
        "reachable": reachable(paper, scaled(100_000), 3),
        "reachable_three_sections": reachable(trunk, scaled(2_000), 4),
        "around_the_straight_arm": reachable(paper, scaled(10_000), 5, around_straight=True),
        "out_of_reach": out_of_reach(paper, scaled(1_000), 6),
    }
