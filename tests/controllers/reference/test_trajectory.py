"""The reference keeps its limits and never jumps, whatever targets come when."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneuarm.controllers.geometry.moving_point import MovingPoint
from pneuarm.controllers.reference.trajectory import (
    Goal,
    Reference,
    ReferenceLimits,
    standing,
)
from pneuarm.controllers.targets.shape import ShapeTarget, perpendicular
from pneuarm.controllers.targets.targets import CircleTarget, LineTarget, TrajectoryTarget

LIMITS = ReferenceLimits(0.4, 3.0, 50.0)
DT_S = 2e-3

coordinate = st.floats(-0.2, 0.2) | st.floats(-1e-3, 1e-3)
speed = st.floats(-0.15, 0.15)
target = st.tuples(
    st.tuples(coordinate, coordinate, coordinate),
    st.none() | st.tuples(speed, speed, speed),
    st.integers(1, 120),
)


def moving(position: tuple[float, ...], velocity: tuple[float, ...] | None) -> Goal:
    if velocity is None:
        return standing(list(position))
    known = list(velocity)
    return lambda ahead_s: MovingPoint(
        [p + v * ahead_s for p, v in zip(position, known, strict=True)], known, [0.0] * 3
    )


@settings(max_examples=60, deadline=None)
@given(st.lists(target, min_size=1, max_size=8))
def test_random_targets_never_exceed_a_limit_and_never_jump(targets: list) -> None:
    reference = Reference(LIMITS)
    motions = [reference.now]
    for position, velocity, ticks in targets:
        (reference.go if velocity is None else reference.stream)(moving(position, velocity))
        assert reference.error == ""
        motions += [reference.step(DT_S) for _ in range(ticks)]
    position, velocity, acceleration = (np.array(part) for part in zip(*motions, strict=True))
    assert np.linalg.norm(velocity, axis=1).max() <= LIMITS.speed_m_s * (1 + 1e-6)
    assert np.linalg.norm(acceleration, axis=1).max() <= LIMITS.acceleration_m_s2 * (1 + 1e-6)
    jerk = np.linalg.norm(np.diff(acceleration, axis=0), axis=1) / DT_S
    assert jerk.max(initial=0.0) <= LIMITS.jerk_m_s3 * (1 + 1e-3)
    # What is said to be the velocity is the one: no jump of the position is hidden.
    change = np.diff(position, axis=0) / DT_S - 0.5 * (velocity[1:] + velocity[:-1])
    assert np.abs(change).max(initial=0.0) <= LIMITS.jerk_m_s3 * DT_S**2 / 6


def test_a_circle_is_met_and_then_followed_exactly() -> None:
    reference = Reference(LIMITS)
    reference.start([0.0, 0.0, 0.2])
    circle = CircleTarget((0.0, 0.0, 0.2), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.04, 0.25)
    reference.go(circle.at)
    for _ in range(1000):
        motion = reference.step(DT_S)
    assert reference.arrived
    assert motion.position == pytest.approx(circle.at(1000 * DT_S).position, abs=1e-9)


def test_a_goal_that_is_no_number_is_not_taken_and_said() -> None:
    reference = Reference(LIMITS)
    reference.go(standing([0.1, 0.0, 0.0]))
    reference.step(DT_S)
    reference.go(standing([float("nan"), 0.0, 0.0]))
    assert "nan" in reference.error
    for _ in range(1000):
        motion = reference.step(DT_S)
    assert motion.position == pytest.approx([0.1, 0.0, 0.0])


def test_a_goal_that_only_rounding_is_between_is_met() -> None:
    rng, reference = np.random.default_rng(0), Reference(LIMITS)

    def tiny() -> np.ndarray:
        return np.asarray(10.0 ** rng.uniform(-18.0, -8.0, 3) * rng.choice([-1.0, 0.0, 1.0], 3))

    for _ in range(4000):
        place = rng.uniform(-0.1, 0.2, 3)
        reference.now = MovingPoint(place.tolist(), tiny().tolist(), tiny().tolist())
        reference.go(standing((place + tiny()).tolist()))
        assert reference.error == ""
        assert reference.step(DT_S).position == pytest.approx(place.tolist(), abs=1e-7)


def _shapes() -> list[ShapeTarget]:
    first, second = perpendicular(np.array([0.3, 0.2, 0.9]))
    return [
        CircleTarget((0.0, 0.1, 0.2), tuple(first), tuple(second), 0.03, 0.5, 2.0),
        LineTarget((0.0, 0.0, 0.2), (0.05, -0.02, 0.19), 2.0, 3.0),
        TrajectoryTarget((0.5, 1.0, 2.2), ((0.0, 0.0, 0.2), (0.03, 0.0, 0.2), (0.0, 0.03, 0.19))),
    ]


@pytest.mark.parametrize("shape", _shapes(), ids=lambda shape: type(shape).__name__)
def test_velocity_and_acceleration_of_shapes_are_the_derivatives(shape: ShapeTarget) -> None:
    step = 1e-5
    for time in np.linspace(0.0, shape.duration_s + 0.1, 40):
        before, now, after = (shape.at(time + d) for d in (-step, 0.0, step))
        velocity = (np.array(after.position) - before.position) / (2 * step)
        acceleration = (np.array(after.velocity) - before.velocity) / (2 * step)
        assert now.velocity == pytest.approx(velocity, abs=1e-6)
        # Waypoints' jerk steps at their points, and at the ends the acceleration is zero.
        assert now.acceleration == pytest.approx(acceleration, abs=1e-3)


def test_waypoints_are_passed_at_their_times_and_rest_at_the_ends() -> None:
    shape = _shapes()[2]
    assert isinstance(shape, TrajectoryTarget)
    for time, point in zip(shape.times_s, shape.positions_m, strict=True):
        assert shape.at(time).position == pytest.approx(point)
    assert shape.at(0.0).position == list(shape.positions_m[0])
    for end in (0.5 + 1e-9, 2.2 - 1e-9):
        assert shape.at(end).velocity == pytest.approx([0.0] * 3, abs=1e-6)
        assert shape.at(end).acceleration == pytest.approx([0.0] * 3, abs=1e-4)
