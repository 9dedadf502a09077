"""Valves, chambers and body together: where the arm ends up, and that nothing breaks it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.kinematics.constant_curvature import tip_transform
from tests.hardware.simulator.test_simulator import BENDING_PA, PAPER, TRUNK, connected, tips


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_weightless_tip_settles_near_constant_curvature(seed: int) -> None:
    """As near as hysteresis, resolution, creep and the varied stiffness let it."""
    arm = replace(PAPER, gravity_m_s2=(0.0, 0.0, 0.0))
    simulated = connected(arm, seed)
    simulated.write(BENDING_PA, 0.0)
    settled = tips(simulated, np.arange(1, 601) * 5e-3)[-1]
    values = simulated.drawn.values
    lost_pa = 1.8e5 * 0.5 * (values.valve_hysteresis_fraction + values.chamber_hysteresis_fraction)
    held_pa = BENDING_PA - np.sign(BENDING_PA) * lost_pa
    crept = 1.0 + values.creep_fraction * (1.0 - np.exp(-2.8 / values.creep_time_constant_s))
    lengthening_m = PressureMap(arm).lengths_m(held_pa) - arm.rest_lengths_m
    (stiffness,) = simulated.drawn.stiffness_factors
    bend_only = lengthening_m - lengthening_m.mean()
    stretch = lengthening_m.mean() / values.axial_stiffness_ratio
    explained_m = (bend_only + stretch) * crept / stiffness + arm.rest_lengths_m
    ideal = tip_transform(arm, PressureMap(arm).lengths_m(BENDING_PA))[:3, 3]
    explained = tip_transform(arm, explained_m)[:3, 3]
    assert np.linalg.norm(settled - explained) < 1.5e-3
    assert 3e-3 < np.linalg.norm(settled - ideal) < 40e-3


@settings(max_examples=8, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 1000),
    period_s=st.sampled_from([1e-3, 2e-3, 5e-3, 0.05]),
    trunk=st.booleans(),
    data=st.data(),
)
def test_any_pressures_leave_it_finite(
    seed: int, period_s: float, trunk: bool, data: st.DataObject
) -> None:
    """Slams over the full range at any moment: no NaN, and the tip stays within reach."""
    arm = TRUNK if trunk else PAPER
    simulated = connected(arm, seed)
    extremes = st.lists(
        st.sampled_from([-9e4, 0.0, 9e4]), min_size=arm.n_chambers, max_size=arm.n_chambers
    )
    time_s = 0.0
    for commanded in data.draw(st.lists(extremes, min_size=4, max_size=8)):
        simulated.write(np.reshape(commanded, (-1, 3)), time_s)
        for _ in range(max(4, round(0.25 / period_s))):
            time_s += period_s
            reading = simulated.read(time_s)
        assert reading.true_tip is not None
        assert np.isfinite(reading.pressures_pa).all()
        assert np.linalg.norm(reading.true_tip[0]) < 2.0 * arm.total_rest_length_m
        np.testing.assert_allclose(np.linalg.det(reading.true_tip[1]), 1.0, atol=1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_twenty_seconds_of_random_slams_leave_it_finite(seed: int) -> None:
    """Every chamber at one end or the other, changed at random times."""
    simulated, rng = connected(seed=seed), np.random.default_rng(seed)
    for tick in range(1, 4000):
        reading = simulated.read(tick * 5e-3)
        if rng.random() < 0.03:
            simulated.write(np.where(rng.random((1, 3)) < 0.5, -9e4, 9e4), tick * 5e-3)
        assert reading.true_tip is not None
        assert np.linalg.norm(reading.true_tip[0]) < 0.45
    simulated.vent(20.0)
    rested = tips(simulated, 20.0 + np.arange(1, 800) * 5e-3)[-1]
    assert abs(rested[0]) + abs(rested[1]) < 0.02
