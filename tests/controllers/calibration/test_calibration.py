"""The fit finds what a recording was made with, and says what a recording does not show."""

from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import UNCOUPLED, Arm, Array
from pneuarm.controllers.arm.errors import CalibrationError
from pneuarm.controllers.calibration.calibrate import Calibration, calibrate
from pneuarm.controllers.calibration.excitation import require_motion
from pneuarm.controllers.calibration.fit import fit
from pneuarm.controllers.calibration.frames import Frames, aligned
from pneuarm.controllers.calibration.hysteresis import play_outputs
from pneuarm.controllers.calibration.model import TipModel
from pneuarm.controllers.calibration.parameters import NAMES, SHAPING, arm_of, start_of
from pneuarm.controllers.calibration.plan import Move, duration_s, plan
from pneuarm.controllers.calibration.recording import (
    Recording,
    Rests,
    find_rests,
    fresh_tips,
    settled,
)
from pneuarm.controllers.calibration.response import fit_response
from pneuarm.controllers.geometry.rotations import rotation_from_vector
from pneuarm.service.configuration.configuration import load
from tests.controllers.calibration.synthetic import (
    COARSE_S,
    PAPER,
    TABLE1,
    other_arm,
    quiet,
    recording_of,
    sent_by,
    short_plan,
)
from tools.rig.arms import ARMS

TRUTH = {"paper": other_arm(PAPER), "table1": other_arm(TABLE1)}
NOMINAL = {"paper": PAPER, "table1": TABLE1}


@cache
def quiet_recording(name: str) -> Recording:
    """Return a recording without swing and lag, so that rests are exact."""
    arm = NOMINAL[name]
    return quiet(TRUTH[name], short_plan(arm))


@cache
def calibration(name: str) -> Calibration:
    return calibrate(NOMINAL[name], quiet_recording(name))


@pytest.mark.parametrize("name", TRUTH)
def test_the_fit_puts_the_tip_where_it_was(name: str) -> None:
    fitted = calibration(name).fit
    before = np.linalg.norm(fitted.before_m - fitted.measured_m, axis=1)
    after = np.linalg.norm(fitted.after_m - fitted.measured_m, axis=1)
    assert before.mean() > 5e-3
    assert after.max() < 5e-4


def test_the_fit_finds_the_parameters_that_made_the_recording() -> None:
    found, truth = calibration("paper").arm.sections[0], TRUTH["paper"].sections[0]
    deviation = calibration("paper").fit.sd[0]
    theta, start = calibration("paper").fit.theta[0], start_of(TRUTH["paper"])[0]
    assert found.hysteresis_pa == pytest.approx(truth.hysteresis_pa, rel=0.02)
    assert found.bending_compliance_rad_per_n_m == pytest.approx(0.8, rel=0.1)
    assert found.lengthening_m_per_pa == pytest.approx(truth.lengthening_m_per_pa, rel=0.03)
    assert found.chamber_offset_m == pytest.approx(truth.chamber_offset_m, rel=0.05)
    assert found.rest_length_m == pytest.approx(truth.rest_length_m, rel=0.02)
    np.testing.assert_allclose(found.coupling, truth.coupling, atol=0.01)
    for place in range(6, 13):  # the coupling is scaled alike in both
        assert abs(theta[place] - start[place]) < 3.0 * deviation[place]


def test_the_fit_finds_the_frames_of_the_measurement_too() -> None:
    recording = quiet_recording("paper")
    frames = Frames(
        rotation_from_vector(np.array([0.3, -0.8, 1.9])),
        np.array([0.5, -0.2, 1.1]),
        np.array([0.0, 0.01, 0.02]),
    )
    rests = find_rests(recording)
    # A turn of all chambers about the backbone would be the base's: there is none in this arm.
    section = replace(TRUTH["paper"].sections[0], coupling=UNCOUPLED)
    truth = replace(TRUTH["paper"], sections=(section,))
    model = TipModel(truth)
    acting, _ = play_outputs(recording.sent_pa, truth.per_section("hysteresis_pa"))
    poses = model.poses(acting, start_of(truth))
    world = frames.measured_m(poses)
    rotations = frames.rotation @ poses[:, 3:].reshape(-1, 3, 3)
    moved = replace(recording, tip_m=world, tip_rotation=rotations)
    found = fit(PAPER, moved, find_rests(moved), in_world=True)
    np.testing.assert_allclose(found.after_m, world[rests.last], atol=6e-4)
    np.testing.assert_allclose(found.frames.rotation, frames.rotation, atol=0.03)
    np.testing.assert_allclose(found.frames.translation_m, frames.translation_m, atol=0.02)
    assert found.in_world
    assert not calibration("paper").fit.in_world


def test_the_response_is_found_from_steps() -> None:
    truth = TRUTH["paper"]
    steps = [move for move in plan(PAPER) if move.ramp_s == 0.0]
    recording = recording_of(truth, sent_by(steps, 1))
    found = fit_response(truth, recording, calibration("paper").fit.frames)
    for lag in ("filling_lag_s", "exhausting_lag_s"):
        assert getattr(found.response, lag) == pytest.approx(getattr(truth.response, lag), rel=0.05)
    assert found.response.delay_s == pytest.approx(truth.response.delay_s, abs=0.005)
    assert found.response.mode_hz == pytest.approx(truth.response.mode_hz, rel=0.03)
    assert found.response.damping_ratio == pytest.approx(truth.response.damping_ratio, rel=0.1)
    assert len(found.steps) == len(steps)


def test_without_a_step_the_mode_is_kept_and_the_note_says_so() -> None:
    whole = quiet_recording("paper")
    first = round(duration_s([m for m in short_plan(PAPER) if m.ramp_s]) / COARSE_S)
    found = calibrate(PAPER, Recording(*(getattr(whole, f.name)[:first] for f in fields(whole))))
    assert not found.response.steps
    assert "mode not identified" in found.note
    assert "step" in found.note
    kept, before = found.arm.response, PAPER.response
    assert (kept.mode_hz, kept.damping_ratio) == (before.mode_hz, before.damping_ratio)
    assert found.response.sd.mode_hz == 0.0


def moved_through(patterns: Array) -> Recording:
    """Recording of the paper's arm resting at the given shares of 0.5 bar."""
    moves = [Move(0.5e5 * pattern.reshape(1, 3), 0.1, 0.95) for pattern in patterns]
    return quiet(TRUTH["paper"], moves)


def refused(recording: Recording) -> str:
    with pytest.raises(CalibrationError) as caught:
        require_motion(PAPER, recording, find_rests(recording))
    return str(caught.value)


def test_a_chamber_that_was_not_moved_is_named() -> None:
    patterns = np.random.default_rng(0).uniform(-1.0, 1.0, (20, 3)) * [1.0, 0.1, 1.0]
    sentence = refused(moved_through(patterns))
    assert sentence.startswith("chamber 2 was never moved beyond 0.0")
    assert "0.45 bar or more" in sentence


def test_chambers_that_were_always_moved_together_are_named() -> None:
    patterns = np.random.default_rng(0).uniform(-1.0, 1.0, (20, 3))
    patterns[:, 2] = patterns[:, 0]
    sentence = refused(moved_through(patterns))
    assert sentence.startswith("chamber 1 and chamber 3 were always moved in the same proportion")


def test_too_few_rests_are_counted() -> None:
    patterns = np.random.default_rng(0).uniform(-1.0, 1.0, (8, 3))
    sentence = refused(moved_through(patterns))
    assert "8 places" in sentence
    assert "12 at least" in sentence


def test_an_arm_that_never_rests_is_refused() -> None:
    recording = quiet_recording("paper")
    restless = recording.sent_pa + 1500.0 * np.arange(len(recording.time_s))[:, None, None]
    with pytest.raises(CalibrationError, match="never still"):
        find_rests(replace(recording, sent_pa=restless))


def test_a_tip_that_was_not_measured_at_a_rest_leaves_it_out() -> None:
    recording = quiet_recording("paper")
    rests = find_rests(recording)
    tips = recording.tip_m.copy()
    tips[rests.last[3] - 5 : rests.last[3] + 1] = np.nan
    assert len(find_rests(replace(recording, tip_m=tips)).last) == len(rests.last) - 1
    old = fresh_tips(recording.tip_m, np.full(len(tips), 0.5))
    assert np.isnan(old).all()


@pytest.mark.parametrize("name", ARMS)
def test_the_parameters_of_an_arm_stand_for_it(name: str) -> None:
    arm = other_arm(ARMS[name])
    back = arm_of(ARMS[name], start_of_shifted(ARMS[name], arm))
    for there, here in zip(arm.sections, back.sections, strict=True):
        for field in ("rest_length_m", "lengthening_m_per_pa", "hysteresis_pa"):
            assert getattr(here, field) == pytest.approx(getattr(there, field))
        np.testing.assert_allclose(here.coupling, there.coupling, atol=1e-12)


def start_of_shifted(nominal: Arm, arm: Arm) -> Array:
    """Parameters of ``arm`` around ``nominal``, whose scales they have."""
    theta = start_of(nominal)
    for index, (section, base) in enumerate(zip(arm.sections, nominal.sections, strict=True)):
        theta[index, 0] = np.log(section.rest_length_m / base.rest_length_m)
        theta[index, 2] = np.log(section.lengthening_m_per_pa / base.lengthening_m_per_pa)
    theta[:, 6:] = start_of(arm)[:, 6:]
    return theta


@pytest.mark.parametrize("name", ARMS)
def test_the_derivative_of_the_tip_is_that_of_the_tip(name: str) -> None:
    arm = other_arm(ARMS[name])
    model, theta = TipModel(arm), start_of(arm)
    rng = np.random.default_rng(8)
    low, high = arm.per_chamber("pressure_min_pa"), arm.per_chamber("pressure_max_pa")
    pressures = rng.uniform(low, high, (2, arm.n_sections, 3)) * 0.5
    tips = model.tips(pressures, theta)
    np.testing.assert_allclose(tips.pose, model.poses(pressures, theta))
    for index in np.ndindex(arm.n_sections, SHAPING):
        change = np.zeros_like(theta)
        change[index] = 1e-6
        slope = (
            model.poses(pressures, theta + change) - model.poses(pressures, theta - change)
        ) / 2e-6
        there = tips.over_theta[:, :, index[0] * SHAPING + index[1]]
        np.testing.assert_allclose(there, slope, atol=1e-6, err_msg=NAMES[index[1]])
    for chamber in range(arm.n_chambers):
        change = np.zeros_like(pressures).reshape(2, -1)
        change[:, chamber] = 10.0
        change = change.reshape(pressures.shape)
        slope = (
            model.poses(pressures + change, theta) - model.poses(pressures - change, theta)
        ) / 20.0
        np.testing.assert_allclose(tips.over_pressure[:, :, chamber], slope, atol=1e-9)


@pytest.mark.parametrize("preset", ["paper", "table1", "trunk"])
def test_the_plan_stays_within_the_limits_and_shows_enough(preset: str) -> None:
    arm = load(preset=preset).build_arm()
    moves = plan(arm)
    pressures = np.array([move.pressures_pa for move in moves])
    assert (pressures >= arm.per_chamber("pressure_min_pa")).all()
    assert (pressures <= arm.per_chamber("pressure_max_pa")).all()
    assert not pressures[-1].any()
    assert duration_s(moves) <= 110.0 * arm.n_sections
    sent = pressures[[move.ramp_s > 0.0 for move in moves]]
    rests = Recording(np.arange(len(sent)), sent, sent, np.zeros((len(sent), 3)))
    require_motion(arm, rests, Rests(np.arange(len(sent)), rests.tip_m))


def test_a_play_holds_until_it_is_pushed_and_its_slope_is_its_derivative() -> None:
    rng = np.random.default_rng(2)
    inputs = np.cumsum(rng.normal(0.0, 500.0, (400, 2, 3)), axis=0)
    width = np.array([[800.0], [300.0]])
    outputs, slopes = play_outputs(inputs, width)
    last = np.zeros((2, 3))
    for given, output in zip(inputs, outputs, strict=True):
        last = np.clip(last, given - width, given + width)
        np.testing.assert_array_equal(output, last)
    wider, _ = play_outputs(inputs, width + 1e-4)
    narrower, _ = play_outputs(inputs, width - 1e-4)
    np.testing.assert_allclose(slopes, (wider - narrower) / 2e-4, atol=1e-6)


def test_a_rigid_motion_is_found_again() -> None:
    rng = np.random.default_rng(3)
    tips = rng.normal(0.0, 0.1, (30, 3))
    rotation, translation = (
        rotation_from_vector(np.array([1.0, 2.0, -0.5])),
        np.array([1.0, 0.0, -2.0]),
    )
    found = aligned(tips, tips @ rotation.T + translation)
    np.testing.assert_allclose(found.rotation, rotation, atol=1e-12)
    np.testing.assert_allclose(found.translation_m, translation, atol=1e-12)


def test_the_derivative_over_the_frames_is_that_of_the_position() -> None:
    rng = np.random.default_rng(4)
    pose = np.concatenate(
        [rng.normal(0, 0.1, 3), rotation_from_vector(rng.normal(0, 1, 3)).reshape(-1)]
    )[None]
    frames = Frames(
        rotation_from_vector(rng.normal(0, 1, 3)), rng.normal(0, 1, 3), rng.normal(0, 0.02, 3)
    )
    derivative = frames.over_frames(pose)[0]
    for index in range(9):
        change = np.zeros(9)
        change[index] = 1e-6
        slope = (frames.moved(change).measured_m(pose) - frames.moved(-change).measured_m(pose))[0]
        np.testing.assert_allclose(derivative[:, index], slope / 2e-6, atol=1e-8)
    for index in range(12):
        change = np.zeros((1, 12))
        change[0, index] = 1e-6
        slope = (frames.measured_m(pose + change) - frames.measured_m(pose - change))[0] / 2e-6
        np.testing.assert_allclose(frames.over_pose()[:, index], slope, atol=1e-8)


def test_rests_are_found_behind_a_dither_and_a_lead() -> None:
    recording = quiet_recording("paper")
    rests = find_rests(recording)
    swing = 1500.0 * np.sign(np.sin(2.0 * np.pi * 33.0 * recording.time_s))[:, None, None]
    found = find_rests(replace(recording, sent_pa=recording.sent_pa + swing))
    assert len(found.last) > 0.8 * len(rests.last)


def test_slow_motion_gives_places_too_and_neighbours_are_in_one_stretch() -> None:
    time_s = np.arange(0.0, 20.0, 0.01)
    sent = 4e4 * np.sin(2.0 * np.pi * time_s / 40.0)[:, None, None] * np.ones((1, 1, 3))
    tips = np.stack([1e-6 * sent[:, 0, 0]] * 3, axis=1)
    found = find_rests(Recording(time_s, sent, sent, tips))
    assert len(found.last) >= 8
    assert found.stretch is not None
    assert len(set(found.stretch.tolist())) == 1
    # The mean tip is that of the middle of its time, where the pressure is read.
    middle = np.interp(time_s[found.last] - 0.2, time_s, tips[:, 0])
    np.testing.assert_allclose(found.tip_m[:, 0], middle, atol=5e-4)


def test_a_place_whose_pressures_still_move_is_none() -> None:
    recording = quiet_recording("paper")
    leaking = recording.measured_pa - 3e4 * (recording.time_s % 1.5)[:, None, None]
    with pytest.raises(CalibrationError, match="settled"):
        find_rests(replace(recording, measured_pa=leaking))


def test_an_arm_has_settled_when_pressures_and_tip_stand() -> None:
    time_s = np.arange(0.0, 1.0, 0.01)
    still, tips = np.zeros((100, 1, 3)), np.zeros((100, 3))
    assert settled(time_s, still, tips)
    assert settled(time_s, np.full_like(still, np.nan), tips)
    assert not settled(time_s, still + 3e3 * time_s[:, None, None], tips)
    assert not settled(time_s, still, tips + 5e-3 * time_s[:, None])
    assert not settled(time_s[:30], still[:30], tips[:30])


def test_a_mode_that_is_not_seen_is_left_out_by_name() -> None:
    truth = TRUTH["paper"]
    steps = [move for move in plan(PAPER) if move.ramp_s == 0.0]
    recording = recording_of(truth, sent_by(steps, 1))
    rng = np.random.default_rng(0)
    shaken = recording.tip_m + np.cumsum(rng.normal(0.0, 1e-3, recording.tip_m.shape), axis=0)
    found = fit_response(truth, replace(recording, tip_m=shaken), calibration("paper").fit.frames)
    assert any(text.startswith("mode not identified") for text in found.not_identified)
    assert found.response.mode_hz == truth.response.mode_hz
    filling_s = truth.response.filling_lag_s
    assert found.response.filling_lag_s == pytest.approx(filling_s, rel=0.1)


def test_the_derivatives_of_a_direction_are_those_of_the_direction() -> None:
    rng = np.random.default_rng(5)
    turned = rotation_from_vector(rng.normal(0, 1, 3))
    pose = np.concatenate([rng.normal(0, 0.1, 3), turned.reshape(-1)])[None]
    frames = Frames(rotation_from_vector(rng.normal(0, 1, 3)), np.ones(3), np.zeros(3))
    derivative = frames.directions_over_frames(pose)[0]
    for index in range(9):
        change = np.zeros(9)
        change[index] = 1e-6
        slope = (frames.moved(change).directions(pose) - frames.moved(-change).directions(pose))[0]
        np.testing.assert_allclose(derivative[:, index], slope / 2e-6, atol=1e-8)
    for index in range(12):
        change = np.zeros((1, 12))
        change[0, index] = 1e-6
        slope = (frames.directions(pose + change) - frames.directions(pose - change))[0] / 2e-6
        np.testing.assert_allclose(frames.directions_over_pose()[:, index], slope, atol=1e-8)
