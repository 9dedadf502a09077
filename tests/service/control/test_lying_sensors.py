"""Invariant 16: whatever a camera says, it moves the command by a bounded amount, and is told once.

In the real loop, on simulated time, with the ways in which a sensor lies.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Array
from pneuarm.service.control.once import Once
from pneuarm.service.modes.mode import Mode
from tools.bench.rig import CameraRig
from tools.rig.simulated import configuration_of

Lie = Callable[[Array, Array, float], tuple[Array, Array]]
HOME = np.array([0.0, 0.0, 0.2])
OFFSET_MAX_M = 0.25 * 0.2


def active(**camera: float) -> CameraRig:
    rig = CameraRig(configuration_of(rate_hz=200.0, seed=1), **camera).activate()  # type: ignore[arg-type]
    rig.to(HOME, 3.0)
    rig.events.clear()
    return rig


def codes(rig: CameraRig) -> list[str]:
    return [event.code for event in rig.events]


class Frozen:
    """The newest pose for ever, to the bit or with noise."""

    def __init__(self, noise_m: float) -> None:
        self._pose: tuple[Array, Array] | None = None
        self._noise_m, self._rng = noise_m, np.random.default_rng(3)

    def __call__(self, position: Array, quaternion: Array, at_s: float) -> tuple[Array, Array]:
        self._pose = self._pose or (position, quaternion)
        return self._pose[0] + self._rng.normal(0.0, self._noise_m, 3), self._pose[1]


def flip(position: Array, quaternion: Array, at_s: float) -> tuple[Array, Array]:
    return position * [-1.0, -1.0, 1.0], quaternion


def exchange(position: Array, quaternion: Array, at_s: float) -> tuple[Array, Array]:
    return position[[1, 0, 2]] * [1.0, -1.0, 1.0], quaternion


def move_about(rig: CameraRig, seconds: float) -> np.ndarray:
    """Slowly, to and fro, as somebody does who sends one target after the other."""
    first = len(rig._records)
    for number in range(round(seconds / 0.5)):
        angle = 0.35 * number
        rig.to(HOME + np.array([0.04 * np.sin(angle), 0.02 * np.sin(2.0 * angle), 0.0]), 0.5)
    return rig.ticks(first)


@pytest.mark.parametrize("noise_m", [0.0, 1e-4])
def test_a_frozen_camera_is_told_and_the_arm_goes_on_as_without_one(noise_m: float) -> None:
    rig = active()
    before_m = rig.ticks()[-1]["tip_offset_m"]
    rig.lie = Frozen(noise_m)
    ticks = move_about(rig, 8.0)
    assert codes(rig).count("tip_pose_not_along") == 1
    assert codes(rig).count("camera_lost") == 1
    assert rig.loop.mode == Mode.ACTIVE
    # What the camera had taught by then is all that is left of it.
    assert np.linalg.norm(ticks["tip_offset_m"][-1] - before_m) < 5e-3
    assert np.linalg.norm(ticks["tip_offset_m"] - before_m, axis=1).max() < 0.025
    last = ticks[-1]
    off_m = np.linalg.norm(last["tip_true_position_m"] - last["tip_estimated_position_m"])
    assert off_m < 3.0 * last["tip_estimated_sigma_m"] + 5e-3
    rig.lie = None
    move_about(rig, 4.0)
    assert "camera_seen" in codes(rig)


@pytest.mark.parametrize("lie", [flip, exchange])
def test_a_camera_with_wrong_axes_is_not_followed(lie: Lie) -> None:
    rig = active()
    rig.lie = lie
    ticks = move_about(rig, 10.0)
    assert {"tip_pose_not_along", "tip_pose_refused"} & set(codes(rig))
    assert np.linalg.norm(ticks["tip_offset_m"], axis=1).max() <= OFFSET_MAX_M + 1e-9
    assert len(codes(rig)) < 10


def test_a_drift_ends_at_the_bound_and_is_told_once() -> None:
    rig = active()
    begin_s = rig.now_ns * 1e-9
    rig.lie = lambda p, q, at_s: (p + np.array([0.02 * (at_s - begin_s), 0.0, 0.0]), q)
    ticks = rig.to(HOME, 8.0)
    assert np.linalg.norm(ticks["tip_offset_m"], axis=1).max() <= OFFSET_MAX_M + 1e-9
    assert np.linalg.norm(ticks["tip_true_position_m"] - HOME, axis=1).max() < OFFSET_MAX_M + 0.01
    assert codes(rig).count("correction_limited") == 1


def test_what_jumps_to_and_fro_stays_within_the_bound_and_fills_no_log() -> None:
    rig = active()
    rig.lie = lambda p, q, at_s: (p + np.array([0.3 * (int(at_s / 0.8) % 2), 0.0, 0.0]), q)
    ticks = move_about(rig, 9.0)
    assert np.linalg.norm(ticks["tip_offset_m"], axis=1).max() < 0.03
    assert codes(rig).count("tip_pose_refused") == 1


def test_a_turned_marker_turns_no_command() -> None:
    rig = active()
    rig.lie = lambda p, q, at_s: (p, np.array([1.0, 0.0, 0.0, 0.0]))
    rig.to(HOME, 2.0)
    assert rig.loop._steering._observer.rotation == pytest.approx(np.eye(3), abs=0.1)
    assert codes(rig).count("correction_limited") == 1


@pytest.mark.parametrize("camera_hz", [5.0, 7.0, 9.0])
def test_a_slow_camera_is_told_once_with_the_key(camera_hz: float) -> None:
    rig = active(camera_hz=camera_hz)
    rig.events.clear()
    rig.to(HOME, 15.0)
    lost = [event for event in rig.events if event.code == "camera_lost"]
    assert 1 <= len(lost) <= 1 + 15.0 / Once.EVERY_S
    assert "feedback.camera_timeout_ms" in lost[0].remedy
    assert len(rig.events) <= 2 * len(lost) + 2


def test_a_pose_that_waited_too_long_is_refused() -> None:
    rig = active()
    rig._delay_ns = -300_000_000  # it counts as received 300 ms before it is taken
    rig.to(HOME, 0.5)
    assert codes(rig).count("tip_pose_late") == 1


def test_the_bounds_are_those_of_the_configuration() -> None:
    configuration = configuration_of(rate_hz=200.0, seed=1)
    feedback = configuration.feedback.model_copy(update={"offset_max_share": 0.05})
    rig = CameraRig(configuration.model_copy(update={"feedback": feedback})).activate()
    rig.to(HOME, 2.0)
    begin_s = rig.now_ns * 1e-9
    rig.lie = lambda p, q, at_s: (p + np.array([0.02 * (at_s - begin_s), 0.0, 0.0]), q)
    ticks = rig.to(HOME, 3.0)
    assert np.linalg.norm(ticks["tip_offset_m"], axis=1).max() <= 0.01 + 1e-9


def test_what_repeats_is_told_once_then_counted() -> None:
    from pneuarm.logs.schema import pneuarm_pb2 as pb
    from pneuarm.service.modes.mode_keeper import Notice

    once, told = Once(), []
    for tick in range(3500):
        notice = Notice(pb.INFO, "camera_seen", "poses arrive")
        if tick % 10 == 0 and (news := once.take(replace(notice), 0.01 * tick)):
            told.append(news.text)
        told += [due.text for due in once.due(0.01 * tick)]
    assert len(told) == 4
    assert "100 times" in told[1]
    assert not once.due(50.0)[1:]
    assert once.due(70.0) == []
    assert once.take(Notice(pb.INFO, "camera_seen", "poses arrive"), 71.0) is not None
