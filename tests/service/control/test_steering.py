"""Reference and correction in the real loop, with a simulated camera, on simulated time."""

import numpy as np
import pytest

from pneuarm.controllers.feedback.estimator import EstimateSource
from pneuarm.controllers.reach.reach import Reach
from pneuarm.controllers.targets.targets import CircleTarget, LengthsTarget, PressuresTarget
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.processes.pipe import RequestMode
from tests.service.control.test_loop_calibrated import calibrated_configuration
from tools.bench.rig import CameraRig
from tools.rig.simulated import configuration_of

HOME = np.array([0.0, 0.0, 0.2])
CIRCLE = CircleTarget((0.0, 0.0, 0.2), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.03, 0.25)


@pytest.fixture(scope="module")
def rig() -> CameraRig:
    rig = CameraRig(configuration_of(seed=1)).activate()
    rig.to(HOME, 4.0)
    return rig


def test_the_measured_tip_takes_the_arm_to_its_target(rig: CameraRig) -> None:
    ticks = rig.to(np.array([0.02, 0.0, 0.2]), 6.0)
    last = ticks[-1]
    assert np.linalg.norm(last["tip_true_position_m"] - [0.02, 0.0, 0.2]) < 2e-3
    assert np.linalg.norm(last["tip_model_position_m"] - last["tip_true_position_m"]) > 5e-3
    assert last["tip_estimated_source"] == EstimateSource.TIP_POSE
    off = last["tip_estimated_position_m"] - last["tip_true_position_m"]
    assert np.linalg.norm(off) < 1e-3
    assert 0.0 < last["tip_estimated_sigma_m"] < 2e-3
    for name in ("reference_position_m", "reference_velocity_m_s", "tip_offset_m"):
        assert np.isfinite(ticks[name]).all()


def test_a_camera_that_sees_the_vented_arm_from_the_start_is_believed() -> None:
    tables = calibrated_configuration().model_dump(exclude_none=True)
    section = tables["arm"]["sections"][0] | {"axial_compliance_mm_per_n": 3.0}
    tables["arm"]["sections"] = [section]  # it hangs further below its rest lengths than may stand
    configuration = Configuration.model_validate(tables)
    rig = CameraRig(configuration)
    rig.run(1.0)
    ticks = rig.ticks()
    hangs_m = np.linalg.norm(ticks["tip_model_position_m"][-1] - HOME)
    assert hangs_m > configuration.feedback.settings().still_max_m
    assert np.ptp(ticks["tip_model_position_m"], axis=0).max() < 1e-6
    assert {event.code for event in rig.events if event.level >= pb.WARNING} == set()


def test_a_target_is_reached_although_the_correction_never_rests() -> None:
    calibrated = calibrated_configuration()
    control = calibrated.control.model_copy(update={"rate_hz": 1000.0})
    rig = CameraRig(calibrated.model_copy(update={"control": control})).activate()
    ticks = rig.to(np.array([0.04, 0.0, 0.2]), 5.0)
    assert ticks["reach"][-1] == Reach.REACHED
    assert np.ptp(ticks["tip_offset_m"][-500:], axis=0).max() > 0.0


def test_loss_and_return_on_a_circle_are_told_and_jump_no_command(rig: CameraRig) -> None:
    def largest(ticks: np.ndarray) -> float:
        changes = np.diff(ticks["tip_commanded_position_m"], axis=0)
        return float(np.linalg.norm(changes, axis=1).max())

    rig.circle(CIRCLE, 10.0)  # whatever was told before may be told again at once
    rig.events.clear()
    undisturbed = largest(rig.circle(CIRCLE, 2.0))
    rig.camera = False
    lost = rig.circle(CIRCLE, 1.0)
    assert lost["tip_estimated_source"][-1] == EstimateSource.PRESSURES
    assert np.ptp(lost["tip_offset_m"][-200:], axis=0).max() == 0.0
    assert lost["tip_estimated_sigma_m"][-1] > lost["tip_estimated_sigma_m"][0]
    rig.camera = True
    back = rig.circle(CIRCLE, 1.0)
    # The correction may move by 50 mm/s, 0.1 mm in a tick, on top of the circle; where it starts
    # and stops, the notch takes it twice as fast for some 20 ms.
    assert largest(lost) < undisturbed + 2e-4
    assert largest(back) < undisturbed + 3e-4
    assert [event.code for event in rig.events] == ["camera_lost", "camera_seen"]


def test_a_jump_is_told_once_and_moves_nothing(rig: CameraRig) -> None:
    rig.to(HOME, 4.0)
    rig.events.clear()
    before = rig.ticks()[-1]["tip_offset_m"]
    rig.outlier_m = np.array([0.06, 0.0, 0.0])
    ticks = rig.to(HOME, 0.08)
    rig.outlier_m = np.zeros(3)
    rig.to(HOME, 0.3)
    assert np.linalg.norm(ticks["tip_offset_m"] - before, axis=1).max() < 2e-3
    assert ticks["tip_poses_refused"][-1] > 4
    assert [event.code for event in rig.events] == ["tip_pose_refused"]


def test_targets_without_a_reference_pass_it_by(rig: CameraRig) -> None:
    lengths = rig.arm.rest_lengths_m + np.array([[0.01, 0.0, 0.0]])
    ticks = rig.run(1.0, LengthsTarget(lengths))
    assert np.isnan(ticks["reference_position_m"][-1]).all()
    assert ticks["length_commanded_m"][-1] == pytest.approx(lengths, abs=1e-4)
    again = rig.to(HOME, 0.02)
    jump = np.linalg.norm(np.diff(again["tip_commanded_position_m"], axis=0), axis=1).max()
    assert jump < 1e-3


def test_arming_again_after_feedback_does_not_move_the_tip() -> None:
    rig = CameraRig(calibrated_configuration()).activate()
    rig.to(np.array([0.03, 0.01, 0.2]), 3.0)
    rig.rest(RequestMode(ModeEvent.HOLD, 2, "bench"), 0.6)
    held = rig.ticks()[-1]
    armed = rig.rest(RequestMode(ModeEvent.ENABLE, 4, "bench"), 1.0)
    assert armed["mode"][-1] == Mode.ACTIVE
    assert armed["pressure_sent_pa"] == pytest.approx(
        np.broadcast_to(held["pressure_sent_pa"], armed["pressure_sent_pa"].shape), abs=1.0
    )
    moved = np.linalg.norm(armed["tip_true_position_m"] - held["tip_true_position_m"], axis=1)
    assert moved.max() < 1e-3


def test_pressures_are_sent_without_lead_or_dither(rig: CameraRig) -> None:
    rig.run(1.0, PressuresTarget(np.zeros((1, 3))))
    wanted_pa = np.array([[2e4, 1e4, 0.0]])
    sent_pa = rig.run(1.0, PressuresTarget(wanted_pa))["pressure_sent_pa"]
    assert sent_pa[-1] == pytest.approx(wanted_pa, abs=50.0)
    assert np.diff(sent_pa, axis=0).min() > -1.0  # never beyond and back, which crosses the play
    assert sent_pa.max(axis=0) == pytest.approx(wanted_pa, abs=50.0)
