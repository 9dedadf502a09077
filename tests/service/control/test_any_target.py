"""No target raises in the tick, legal or not; what is the same is reached, what is fast is told."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.reach.reach import Reach
from pneuarm.controllers.targets.chambers import PostureTarget
from pneuarm.controllers.targets.checks import FASTEST_M_S
from pneuarm.controllers.targets.targets import (
    CircleTarget,
    PoseTarget,
    PositionTarget,
    ShapeTarget,
    Target,
)
from pneuarm.controllers.targets.together import TasksTarget
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.processes.pipe import RequestMode, SetTarget
from tools.rig.simulated import Bench, configuration_of

HOME = np.array([0.0, 0.0, 0.2])


def bench_of(rate_hz: float = 200.0, target_timeout_s: float = 0.2) -> Bench:
    bench = Bench(configuration=configuration_of(rate_hz=rate_hz)).activate()
    bench.run(0.3, PositionTarget(HOME))
    bench.events.clear()
    return bench


places = st.tuples(*[st.floats(-0.6, 0.6)] * 3)
velocities = st.none() | st.tuples(*[st.floats(-2.8, 2.8)] * 3)
steps = st.tuples(
    st.sampled_from(["position", "pose", "circle"]),
    places,
    velocities,
    st.integers(1, 8),  # how often it is sent
    st.sampled_from([0.005, 0.01, 0.03, 0.1, 0.15]),  # period of the sending, s
)


def target_of(kind: str, place: tuple, velocity: tuple | None, id: int) -> Target:
    position = np.array(place)
    if kind == "pose":
        quaternion = np.array([*place, 0.5])
        return PoseTarget(position, quaternion / np.linalg.norm(quaternion))
    if kind == "circle":  # past the gateway's check of its speed
        x, y, z = place
        return CircleTarget((x, y, z), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.3, 4.0, 1.0, id=id)
    return PositionTarget(position, velocity_m_s=None if velocity is None else np.array(velocity))


@settings(max_examples=25, deadline=None)
@example([("position", (0.05, 0.0, 0.2), (0.8, 0.0, 0.0), 8, 0.1)])
@example([("position", (0.0, 0.0, 0.2), (0.0, -5.0 / 1.8, 0.0), 3, 0.15)])
@given(st.lists(steps, min_size=1, max_size=6))
def test_no_target_of_any_velocity_and_period_raises_in_the_tick(given_steps: list) -> None:
    bench = bench_of()
    for number, (kind, place, velocity, times, period_s) in enumerate(given_steps):
        if kind == "position" and velocity is not None:
            assert np.linalg.norm(velocity) <= FASTEST_M_S
        for repeat in range(times):
            moved = np.zeros(3) if velocity is None else repeat * period_s * np.array(velocity)
            target = target_of(kind, tuple(np.array(place) + moved), velocity, number)
            bench.tick(bench.target(target))
            for _ in range(round(period_s * 200.0) - 1):
                bench.tick()
    assert "tick_failed" not in bench.codes()
    assert bench.mode == Mode.ACTIVE


# Told as the gateway never lets it through; NumPy warns where infinities are subtracted.
@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e300])
@pytest.mark.parametrize("kind", ["position", "velocity", "pose"])
def test_what_is_no_number_does_not_raise_either(kind: str, bad: float) -> None:
    bench, values = bench_of(), np.array([0.0, bad, 0.2])
    target: Target = PositionTarget(values)
    if kind == "velocity":
        target = PositionTarget(HOME, velocity_m_s=values)
    elif kind == "pose":
        target = PoseTarget(values, np.array([0.0, 0.0, 0.0, 1.0]))
    bench.run(0.3, target)
    assert "tick_failed" not in bench.codes()
    assert np.isfinite(bench.newest["pressure_sent_pa"]).all()
    bench.run(
        0.5, PositionTarget(HOME + np.array([0.01, 0.0, 0.0]))
    )  # and the arm is not lost for it
    assert np.isfinite(bench.newest["tip_commanded_position_m"]).all()


def test_a_stream_that_is_too_fast_is_followed_as_fast_as_may_be_and_told_once() -> None:
    """8 cm to and fro at 2 Hz, at 100 Hz with its own velocity: 1 m/s."""
    bench, omega = bench_of(), 4.0 * np.pi
    for number in range(300):
        angle = omega * 0.01 * number
        position = HOME + np.array([0.08 * np.sin(angle), 0.0, 0.0])
        velocity = np.array([0.08 * omega * np.cos(angle), 0.0, 0.0])
        bench.tick(bench.target(PositionTarget(position, velocity_m_s=velocity)))
        bench.tick()
    told = [event for event in bench.events if event.code == "target_too_fast"]
    assert len(told) == 1
    assert "reference.speed_max_mm_s" in told[0].remedy
    assert bench.mode == Mode.ACTIVE
    assert "tick_failed" not in bench.codes()
    speed = np.linalg.norm(bench.ticks()["reference_velocity_m_s"], axis=1)
    assert np.nanmax(speed) <= 0.5 + 1e-9


@pytest.mark.parametrize("noise", [1e-9, 1e-7, 1e-6])
@pytest.mark.parametrize("kind", ["position", "pose", "circle"])
def test_the_same_with_noise_is_the_same(kind: str, noise: float) -> None:
    bench, rng = bench_of(), np.random.default_rng(1)
    for _ in range(300):
        place = HOME + np.array([0.02, 0.01, 0.0]) + rng.uniform(-noise, noise, 3)
        if kind == "circle":
            target: Target = CircleTarget(
                tuple(place), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.02, 1.0, 1.0
            )
        elif kind == "pose":
            quaternion = np.array([0.0, 0.0, 0.0, 1.0]) + rng.uniform(-noise, noise, 4)
            target = PoseTarget(place, quaternion / np.linalg.norm(quaternion))
        else:
            target = PositionTarget(place)
        bench.tick(bench.target(target))
        bench.tick()
    follower = bench.loop._steering._follower
    assert follower.arrived
    if kind == "position":
        assert bench.newest["reach"] == Reach.REACHED
    if kind == "circle":
        assert isinstance(follower._target, ShapeTarget)


def test_a_quaternion_of_either_sign_is_the_same_rotation() -> None:
    """Also among several tasks, which no reference stands before."""
    bench, turned = bench_of(), np.array([0.1, 0.0, 0.0, 0.99**0.5])
    for number in range(300):
        pose = PoseTarget(HOME + np.array([0.0, -0.02, 0.0]), (-1.0) ** number * turned)
        bench.tick(bench.target(TasksTarget((pose, PostureTarget()))))
        bench.tick()
    assert bench.newest["reach"] == Reach.REACHED


def test_what_creeps_is_followed_all_the_same() -> None:
    bench = bench_of()
    for number in range(2000):
        place = HOME + np.array([0.0, 1e-6 * number, 0.0])  # 0.1 mm/s
        bench.tick(bench.target(PositionTarget(place)))
        bench.tick()
    assert bench.newest["reference_position_m"][1] == pytest.approx(2e-3, abs=1e-4)


def circle(time_s: float) -> Array:
    angle = 0.047 / 0.03 * time_s  # 47 mm/s
    return HOME + np.array([0.03 * np.cos(angle), 0.03 * np.sin(angle), 0.0])


@pytest.mark.parametrize("noise_m", [0.0, 1e-6])
def test_positions_at_30_hz_sent_again_at_100_hz_are_a_stream(noise_m: float) -> None:
    rng = np.random.default_rng(0)

    def largest_error_m(source_hz: float) -> float:
        bench, errors = bench_of(), []
        bench.run(2.0, PositionTarget(circle(0.0)))
        begin_s = bench.now_s
        for number in range(600):
            at_s = 0.01 * number
            seen_s = np.floor(at_s * source_hz + 1e-6) / source_hz
            place = circle(seen_s) + rng.uniform(-noise_m, noise_m, 3)
            bench.tick(bench.target(PositionTarget(place)))
            bench.tick()
            if number > 200:
                wanted = circle(bench.now_s - begin_s)
                errors.append(np.linalg.norm(bench.newest["reference_position_m"] - wanted))
        return float(max(errors))

    # What the source itself is late is 33 ms, 1.6 mm; standing between its positions is 5 mm.
    assert largest_error_m(100.0) < 1.5e-3
    assert largest_error_m(30.0) < 3e-3


def test_a_stop_behind_a_command_that_fails_is_heard(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = bench_of()

    def fails(command: SetTarget) -> None:
        raise ValueError("a mistake")

    monkeypatch.setattr(bench.loop._steering, "set_target", fails)
    stop = RequestMode(ModeEvent.ESTOP, 4, "me")
    bench.tick(bench.target(PositionTarget(HOME)), stop)
    assert bench.mode == Mode.ESTOP
    assert [reply.request_id for reply in bench.replies][-1] == 4
    assert bench.replies[-1].accepted
