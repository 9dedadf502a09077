"""A fit is judged at places it did not see: wrong nominals are found or refused by their cause."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import CalibrationError
from pneuarm.controllers.calibration.calibrate import calibrate
from pneuarm.controllers.calibration.fit import Fit
from pneuarm.controllers.calibration.recording import Recording
from pneuarm.controllers.calibration.worth import LARGEST_SHARE, held_out_mean_m
from pneuarm.controllers.geometry.rotations import rotation_from_vector
from tests.controllers.calibration.synthetic import COARSE_S, PAPER, other_arm, short_plan
from tools.rig.foreign_arms import ForeignArm, recording_of, rod_of, sent_by

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]

LENGTH_M = PAPER.total_rest_length_m


@cache
def recorded(
    order: tuple[int, int, int] = (0, 1, 2),
    stiff: float = 1.0,
    softness: tuple[float, ...] = (1.0,) * 4,
    gravity: tuple[float, float, float] = (0.0, 0.0, 9.81),
) -> Recording:
    """Recording of a rod with its own weight that is no arc, driven through the paper's plan."""
    arm = replace(other_arm(PAPER), gravity_m_s2=gravity)
    section = arm.sections[0]
    section = replace(section, lengthening_m_per_pa=section.lengthening_m_per_pa / stiff)
    true = replace(arm, sections=(replace(section, softening_m_per_pa2=0.0),))
    foreign = ForeignArm(true, rod_of(true, 0.2), softness)
    return recording_of(foreign, sent_by(short_plan(PAPER), 1, COARSE_S), COARSE_S, order)


def with_section(**changes: float) -> Arm:
    return replace(PAPER, sections=(replace(PAPER.sections[0], **changes),))


def found_by(arm: Arm, recording: Recording) -> Fit:
    return calibrate(arm, recording).fit


def refused(arm: Arm, recording: Recording) -> str:
    with pytest.raises(CalibrationError) as caught:
        calibrate(arm, recording)
    return str(caught.value)


@pytest.mark.parametrize(
    ("field", "factor"),
    [
        ("lengthening_m_per_pa", 0.1),
        ("lengthening_m_per_pa", 12.0),
        ("chamber_offset_m", 0.1),
        ("chamber_offset_m", 8.0),
    ],
)
def test_a_number_that_is_far_off_is_found(field: str, factor: float) -> None:
    right = getattr(PAPER.sections[0], field)
    found = found_by(with_section(**{field: factor * right}), recorded())
    assert held_out_mean_m(found) < 0.01 * LENGTH_M


def test_an_arm_that_hardly_moves_is_refused() -> None:
    assert "move" in refused(PAPER, recorded(stiff=50.0))


@pytest.mark.parametrize(("order", "exchanged"), [((0, 2, 1), (2, 3))])
def test_exchanged_valves_are_named(
    order: tuple[int, int, int], exchanged: tuple[int, int]
) -> None:
    sentence = refused(PAPER, recorded(order))
    one, other = exchanged
    assert f"chamber {one} by valve {other}" in sentence
    assert f"chamber {other} by valve {one}" in sentence


@pytest.mark.parametrize("turn_deg", [(90.0, 0.0, 0.0)])
def test_a_frame_that_is_turned_is_named(turn_deg: tuple[float, float, float]) -> None:
    recording, turn = recorded(), rotation_from_vector(np.deg2rad(turn_deg))
    rotation = recording.tip_rotation
    assert rotation is not None
    turned = replace(recording, tip_m=recording.tip_m @ turn.T, tip_rotation=turn @ rotation)
    sentence = refused(PAPER, turned)
    assert f"{max(turn_deg):.0f} degrees" in sentence
    assert "[frames]" in sentence
    assert "--world" in sentence


def test_gravity_the_other_way_is_named() -> None:
    sentence = refused(replace(PAPER, gravity_m_s2=(0.0, 0.0, -9.81)), recorded())
    assert "gravity_m_s2 = [0.0, 0.0, 9.81]" in sentence


@pytest.mark.parametrize(
    ("softness", "gravity", "share"),
    [
        ((1.0,) * 4, (0.0, 0.0, 9.81), 0.008),
        ((0.55, 0.85, 1.15, 1.45), (0.0, 0.0, 9.81), 0.012),
        ((1.45, 1.15, 0.85, 0.55), (0.0, 0.0, 9.81), 0.012),
        ((0.7, 0.9, 1.1, 1.3), (0.0, 6.94, 6.94), 0.02),
    ],
)
def test_a_body_unlike_the_papers_is_followed_as_far_as_an_arc_can(
    softness: tuple[float, ...], gravity: tuple[float, float, float], share: float
) -> None:
    arm = replace(PAPER, gravity_m_s2=gravity)
    found = found_by(arm, recorded(softness=softness, gravity=gravity))
    assert held_out_mean_m(found) < share * LENGTH_M
    # What no arc can follow, place and direction together, is there to be told.
    assert np.isfinite(found.held_out_rad).all()
    assert 0.0 < np.median(found.held_out_rad) < np.deg2rad(15.0)


def test_a_motion_that_nothing_explains_is_refused_with_figures() -> None:
    recording = recorded()
    rng = np.random.default_rng(3)
    slipping = np.repeat(rng.normal(0.0, 0.02, (40, 3)), -(-len(recording.tip_m) // 40), axis=0)
    tips: Array = recording.tip_m + slipping[: len(recording.tip_m)]
    sentence = refused(PAPER, replace(recording, tip_m=tips))
    assert "did not see" in sentence
    assert f"{100.0 * LARGEST_SHARE:g} %" in sentence or "bound" in sentence


def test_a_parameter_on_its_bound_is_named() -> None:
    right = PAPER.sections[0].lengthening_m_per_pa
    sentence = refused(with_section(lengthening_m_per_pa=1e-7 * right), recorded())
    assert "of section 1 ended on its bound" in sentence


def test_a_marker_that_sits_turned_on_the_tip_changes_no_place() -> None:
    recording = recorded()
    turn = rotation_from_vector(np.array([0.0, 0.6, 0.0]))
    rotation = recording.tip_rotation
    assert rotation is not None
    turned = found_by(PAPER, replace(recording, tip_rotation=rotation @ turn))
    straight = found_by(PAPER, recording)
    np.testing.assert_allclose(turned.after_m, straight.after_m, atol=5e-4)
    assert np.rad2deg(np.arccos(turned.frames.axis[2])) == pytest.approx(np.rad2deg(0.6), abs=3.0)
