"""The estimate: a length sensor where there is one, the pressure elsewhere."""

import numpy as np
import pytest

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.feedback.estimator import Estimator
from pneuarm.controllers.kinematics.constant_curvature import tip_transform
from tests.controllers.actuation.test_actuation_loaded import loaded
from tools.rig.arms import ARMS, random_lengths, trunk_arm

every_arm = pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)


@every_arm
def test_without_a_sensor_the_lengths_follow_from_the_pressures(arm: Arm) -> None:
    lengths = random_lengths(arm, np.random.default_rng(0))
    pressures = PressureMap(arm).pressures_pa(lengths)
    unknown = np.full_like(lengths, np.nan)
    np.testing.assert_allclose(Estimator(arm).lengths_m(pressures, unknown), lengths, atol=1e-15)


@every_arm
def test_a_measured_length_goes_before_the_map_chamber_by_chamber(arm: Arm) -> None:
    rng = np.random.default_rng(1)
    from_pressure, measured = random_lengths(arm, rng), random_lengths(arm, rng)
    known = np.array([[True, False, True]] * arm.n_sections)
    estimate = Estimator(arm).lengths_m(
        PressureMap(arm).pressures_pa(from_pressure), np.where(known, measured, np.nan)
    )
    np.testing.assert_array_equal(estimate[known], measured[known])
    np.testing.assert_allclose(estimate[~known], from_pressure[~known], atol=1e-15)


@every_arm
def test_the_tip_is_the_one_of_constant_curvature(arm: Arm) -> None:
    lengths = random_lengths(arm, np.random.default_rng(2))
    tip = Estimator(arm).tip(lengths)
    expected = tip_transform(arm, lengths)
    np.testing.assert_allclose(tip.position_m, expected[:3, 3], atol=1e-14)
    np.testing.assert_allclose(tip.rotation, expected[:3, :3], atol=1e-14)


def test_the_lengths_of_a_calibrated_arm_are_those_of_its_map_from_tick_to_tick() -> None:
    arm = loaded(trunk_arm())
    estimator, pressure_map = Estimator(arm), PressureMap(arm)
    unknown = np.full((3, 3), np.nan)
    for share in np.linspace(-0.5, 0.5, 11):
        pressures = share * arm.per_chamber("pressure_max_pa") * [1.0, -0.5, 0.2]
        lengths = estimator.lengths_m(pressures, unknown)
        np.testing.assert_allclose(lengths, pressure_map.lengths_m(pressures), atol=1e-9)
    assert np.isnan(estimator.lengths_m(unknown, unknown)).all()
    np.testing.assert_allclose(estimator.lengths_m(pressures, unknown), lengths, atol=1e-9)
