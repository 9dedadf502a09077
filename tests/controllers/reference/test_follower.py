"""The reference over targets of all kinds: continuous, streams without lag, poses too."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pneuarm.controllers.arm.arm import Response
from pneuarm.controllers.feedback.prediction import Prediction
from pneuarm.controllers.geometry.rotations import quaternion_from_rotation, rotation_from_vector
from pneuarm.controllers.kinematics.compiled import CompiledKinematics, TipState
from pneuarm.controllers.reference.follower import Follower, Lead, lead_of
from pneuarm.controllers.reference.trajectory import ReferenceLimits
from pneuarm.controllers.targets.targets import CircleTarget, PoseTarget, PositionTarget, Target
from tools.rig.arms import paper_arm

LIMITS = ReferenceLimits(0.5, 4.0, 80.0)
DT_S = 1e-3
ARM = paper_arm()
HOME = TipState(np.array([0.0, 0.0, 0.2]), np.eye(3), np.zeros((6, 3)))
RESPONSE = Response(
    delay_s=0.007, filling_lag_s=0.01, exhausting_lag_s=0.01, mode_hz=2.2, damping_ratio=0.13
)
CIRCLE = CircleTarget((0.0, 0.0, 0.2), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.04, 0.25, 1.0)


class Drive:
    """A follower whose arm is where the law was told, without any lead."""

    def __init__(self) -> None:
        self.follower = Follower(ARM, LIMITS, Lead(), 1e9, DT_S)
        self.tip, self.now_s = HOME, 10.0
        self.positions: list[np.ndarray] = [HOME.position_m]

    def set(self, target: Target) -> None:
        self.follower.set_target(target, self.now_s, self.tip, np.zeros(3))
        assert self.follower.error == ""

    def run(self, ticks: int) -> None:
        for _ in range(ticks):
            self.now_s += DT_S
            wanted = self.follower.step(DT_S, ARM.rest_lengths_m)
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


#: The pose is left at its fastest, between the goals' limit and the plans'.
FASTEST: list[tuple[str, float, float, int]] = [
    ("position", -0.03125, 0.0, 70),
    ("position", 0.0, 0.0, 182),
    ("pose", 0.03125, 0.0, 107),
    ("position", 0.0, 0.0, 5),
]


@settings(max_examples=25, deadline=None)
@example(FASTEST)
@given(st.lists(st.tuples(kinds, spot, spot, st.integers(5, 200)), min_size=1, max_size=6))
def test_no_change_of_target_jumps_in_position_or_velocity(steps: list) -> None:
    drive = Drive()
    for number, (kind, x, y, ticks) in enumerate(steps):
        if kind == "position":
            drive.set(PositionTarget(np.array([x, y, 0.2])))
        elif kind == "pose":
            drive.set(pose(5 * x, (x, y, 0.2)))
        else:
            drive.set(replace(CIRCLE, id=number))
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


def eight(time_s: float) -> np.ndarray:
    angle = 0.5 * np.pi * time_s
    return np.array([0.04 * np.sin(angle), 0.02 * np.sin(2.0 * angle), 0.2])


@pytest.mark.parametrize("with_velocity", [True, False])
def test_a_stream_is_as_smooth_as_what_it_follows(with_velocity: bool) -> None:
    drive = Drive()
    for number in range(500):
        now_s = 0.01 * number
        velocity = (eight(now_s + 1e-5) - eight(now_s - 1e-5)) / 2e-5 if with_velocity else None
        drive.set(PositionTarget(eight(now_s), velocity_m_s=velocity))
        drive.run(10)
    times = DT_S * np.arange(len(drive.positions))
    wanted = np.array([eight(time_s) for time_s in times])
    # The largest acceleration of the eight itself is 0.22 m/s^2.
    accelerations = np.diff(np.array(drive.positions) - wanted, 2, axis=0) / DT_S**2
    assert np.linalg.norm(accelerations[1000:], axis=1).max() < 0.05
    assert np.linalg.norm(np.array(drive.positions) - wanted, axis=1)[1500:].max() < 1e-3


class Body:
    """The arm behind a perfect law: the lengths that give what the law is told, late and lagged."""

    def __init__(self) -> None:
        self.follower = Follower(ARM, LIMITS, lead_of(RESPONSE), 20.0, DT_S)
        self._kinematics = CompiledKinematics(ARM)
        self.lengths_m = ARM.rest_lengths_m.copy()
        self.prediction = Prediction(replace(ARM, response=RESPONSE), DT_S)

    def run(self, ticks: int) -> np.ndarray:
        """Distance of the tip from the reference in every tick, m."""
        errors = []
        for _ in range(ticks):
            wanted = self.follower.step(DT_S, self.lengths_m)
            assert isinstance(wanted, PositionTarget)
            for _ in range(3):
                tip = self._kinematics.evaluate(self.lengths_m)
                off_m = wanted.position_m - tip.position_m
                self.lengths_m = self.lengths_m + np.linalg.solve(tip.jacobian[:3], off_m)
            self.prediction.step(self.lengths_m)
            assert self.follower.motion is not None
            position, _ = self.prediction.ago(RESPONSE.delay_s)
            errors.append(float(np.linalg.norm(position - self.follower.motion.position)))
        return np.array(errors)


def test_the_body_behind_lag_and_mode_is_where_the_reference_is() -> None:
    body = Body()
    body.follower.set_target(PositionTarget(HOME.position_m), 0.0, HOME, np.zeros(3))
    target = np.array([0.05, 0.0, 0.2])
    body.follower.set_target(PositionTarget(target), 0.0, HOME, np.zeros(3))
    errors = body.run(2000)
    assert body.follower.arrived
    assert errors.max() < 1e-3  # a third order that is left out alone would swing by 2 mm
    assert errors[800:].max() < 2e-4


def test_on_a_fast_circle_the_body_does_not_swing_out_of_its_plane() -> None:
    body = Body()
    fast = replace(CIRCLE, frequency_hz=1.0, turns=10.0)
    body.follower.set_target(fast, 0.0, HOME, np.zeros(3))
    # Led straight ahead, 8 mm inside the circle, the tip would swing out and 2 mm too low.
    assert body.run(4000)[2000:].max() < 3e-4


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
        drive.set(replace(CIRCLE, id=7))
        if number == 200:
            assert drive.positions[-1] == pytest.approx(CIRCLE.at(2.0).position, abs=1e-3)
        drive.run(10)
    assert drive.follower.arrived
    assert drive.positions[-1] == pytest.approx([0.04, 0.0, 0.2], abs=1e-9)
    drive.set(replace(CIRCLE, id=8))
    drive.run(200)
    assert not drive.follower.arrived


def test_a_pose_is_reached_in_position_and_orientation() -> None:
    drive = Drive()
    drive.set(pose(0.7, (0.05, 0.0, 0.19)))
    drive.run(300)
    drive.set(pose(-0.4, (0.02, 0.03, 0.19)))
    drive.run(2000)
    wanted = drive.follower.step(DT_S, ARM.rest_lengths_m)
    assert isinstance(wanted, PoseTarget)
    assert wanted.position_m == pytest.approx([0.02, 0.03, 0.19])
    assert wanted.quaternion_xyzw == pytest.approx(pose(-0.4, (0, 0, 0)).quaternion_xyzw, abs=1e-9)
