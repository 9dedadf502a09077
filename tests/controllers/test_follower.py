"""The reference over targets of all kinds: continuous, streams without lag, poses too."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.follower import Follower, Lead, _spin
from controllers.frames import rotation_from_vector, rotation_vector
from controllers.kinematics.compiled import TipState
from controllers.shapes import Circle
from controllers.targets import CircleTarget, PoseTarget, PositionTarget, Target
from controllers.tasks.tip_pose import quaternion_from_rotation
from controllers.trajectory import ReferenceLimits

LIMITS = ReferenceLimits(0.5, 4.0, 80.0)
DT_S = 1e-3
HOME = TipState(np.array([0.0, 0.0, 0.2]), np.eye(3), np.zeros((6, 3)))
CIRCLE = Circle((0.0, 0.0, 0.2), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.04, 0.25, 1.0)


class Drive:
    """A follower whose arm is where the law was told, without any lead."""

    def __init__(self) -> None:
        self.follower = Follower(LIMITS, Lead(), 1e9)
        self.tip, self.now_s = HOME, 10.0
        self.positions: list[np.ndarray] = [HOME.position_m]

    def set(self, target: Target) -> None:
        self.follower.set_target(target, self.now_s, self.tip, np.zeros(3))
        assert self.follower.error == ""

    def run(self, ticks: int) -> None:
        for _ in range(ticks):
            self.now_s += DT_S
            wanted = self.follower.step(DT_S)
            assert isinstance(wanted, PositionTarget | PoseTarget)
            self.tip = TipState(wanted.position_m, HOME.rotation, HOME.jacobian)
            self.positions.append(wanted.position_m)

    def accelerations(self) -> np.ndarray:
        return np.linalg.norm(np.diff(self.positions, 2, axis=0), axis=1) / DT_S**2


def pose(angle: float, position: tuple[float, ...]) -> PoseTarget:
    rotation = rotation_from_vector(np.array([0.0, angle, 0.0]))
    return PoseTarget(np.array(position), quaternion_from_rotation(rotation))


kinds = st.sampled_from(["position", "pose", "circle"])
spot = st.floats(-0.05, 0.05)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(kinds, spot, spot, st.integers(5, 200)), min_size=1, max_size=6))
def test_no_change_of_target_jumps_in_position_or_velocity(steps: list) -> None:
    drive = Drive()
    for number, (kind, x, y, ticks) in enumerate(steps):
        if kind == "position":
            drive.set(PositionTarget(np.array([x, y, 0.2])))
        elif kind == "pose":
            drive.set(pose(5 * x, (x, y, 0.2)))
        else:
            drive.set(CircleTarget(CIRCLE, number))
        drive.run(ticks)
    # A jump of the velocity by 5 mm/s would be an acceleration of 5 m/s^2 for one tick.
    assert drive.accelerations().max() < LIMITS.acceleration_m_s2 * 1.15


def test_a_stream_of_positions_is_followed_without_lag_and_ends_at_its_last() -> None:
    drive, errors = Drive(), []
    rng = np.random.default_rng(1)
    for number in range(400):  # 100 Hz, with the network's jitter
        x = 0.04 * np.sin(2 * np.pi * 0.25 * number * 0.01)
        drive.set(PositionTarget(np.array([x, 0.0, 0.2])))
        drive.run(10 + int(rng.integers(-2, 3)) * (number % 2))
        wanted = 0.04 * np.sin(2 * np.pi * 0.25 * (drive.now_s - 10.0))
        errors.append(abs(drive.positions[-1][0] - wanted))
        drive.now_s = 10.0 + (number + 1) * 0.01
    assert np.median(errors[100:]) < 3e-4  # 63 mm/s: 10 ms are 0.6 mm
    drive.run(1500)
    assert drive.follower.arrived
    assert drive.positions[-1] == pytest.approx([x, 0.0, 0.2], abs=1e-9)


def test_a_single_far_target_is_no_stream() -> None:
    drive = Drive()
    for _ in range(10):
        drive.set(PositionTarget(np.array([0.0, 0.0, 0.2])))
        drive.run(20)
    for _ in range(60):
        drive.set(PositionTarget(np.array([0.05, 0.0, 0.2])))
        drive.run(20)
    x = np.array(drive.positions)[:, 0]
    assert x.max() <= 0.05 + 1e-9
    assert drive.follower.arrived


def test_a_shape_sent_again_goes_on_and_stands_at_its_end() -> None:
    drive = Drive()
    for number in range(480):
        drive.set(CircleTarget(CIRCLE, 7))
        if number == 200:
            assert drive.positions[-1] == pytest.approx(CIRCLE.at(2.0).position, abs=1e-3)
        drive.run(10)
    assert drive.follower.arrived
    assert drive.positions[-1] == pytest.approx([0.04, 0.0, 0.2], abs=1e-9)
    drive.set(CircleTarget(CIRCLE, 8))
    drive.run(200)
    assert not drive.follower.arrived


def test_a_pose_is_reached_in_position_and_orientation() -> None:
    drive = Drive()
    drive.set(pose(0.7, (0.05, 0.0, 0.19)))
    drive.run(300)
    drive.set(pose(-0.4, (0.02, 0.03, 0.19)))
    drive.run(2000)
    wanted = drive.follower.step(DT_S)
    assert isinstance(wanted, PoseTarget)
    assert wanted.position_m == pytest.approx([0.02, 0.03, 0.19])
    assert wanted.quaternion_xyzw == pytest.approx(pose(-0.4, (0, 0, 0)).quaternion_xyzw, abs=1e-9)


def test_the_spin_of_a_rotation_vector_is_the_derivative_of_its_rotation() -> None:
    turn, rate = np.array([0.4, -0.9, 0.3]), np.array([0.2, 0.5, -1.0])
    step = 1e-6
    later, before = (rotation_from_vector(turn + d * rate) for d in (step, -step))
    numeric = rotation_vector(later @ before.T) / (2 * step)
    assert _spin(turn, rate) == pytest.approx(numeric, abs=1e-6)
    assert _spin(np.zeros(3), rate) == pytest.approx(rate)
