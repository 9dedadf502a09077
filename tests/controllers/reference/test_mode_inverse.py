"""The way that the inverse of the mode leads ahead of a moving tip."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.kinematics.compiled import CompiledKinematics
from pneuarm.controllers.reference.mode_inverse import ModeInverse
from tools.rig.arms import ARMS, random_lengths

BY_RATE_S, BY_ACCELERATION_S2 = 0.022, 0.0052

INVERSES = {name: ModeInverse(arm, BY_RATE_S, BY_ACCELERATION_S2) for name, arm in ARMS.items()}

vectors = st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3).map(np.array)


def mean_free(lengths: Array) -> Array:
    bent: Array = lengths - lengths.mean(axis=1, keepdims=True)
    return bent


@pytest.mark.parametrize("name", ARMS)
def test_a_tip_at_rest_is_not_led(name: str) -> None:
    lengths = random_lengths(ARMS[name], np.random.default_rng(0), 0.5)
    assert not INVERSES[name].way_m(np.zeros(3), np.zeros(3), lengths).any()


@given(velocity=vectors, acceleration=vectors)
def test_a_slight_motion_of_the_straight_arm_is_led_sideways_alone(
    velocity: Array, acceleration: Array
) -> None:
    """The straight arm bends sideways; along itself it lengthens, which follows at once."""
    arm = ARMS["paper"]
    velocity, acceleration = 1e-3 * velocity, 1e-2 * acceleration
    way_m = INVERSES["paper"].way_m(velocity, acceleration, arm.rest_lengths_m)
    straight_m = BY_RATE_S * velocity + BY_ACCELERATION_S2 * acceleration
    assert way_m[:2] == pytest.approx(straight_m[:2], rel=2e-3, abs=2e-7)
    assert abs(way_m[2]) < 1e-6


def motion(arm: Arm, seed: int) -> tuple[Array, Array, Array]:
    """Lengths, rates and changes of rates (n_sections, 3) of an arm that moves its tip least."""
    rng = np.random.default_rng(seed)
    lengths = random_lengths(arm, rng, 0.5)
    jacobian = CompiledKinematics(arm).evaluate(lengths).jacobian[:3].copy()
    rates, changes = (jacobian.T @ rng.uniform(-size, size, 3) for size in (0.02, 0.2))
    return lengths, rates.reshape(lengths.shape), changes.reshape(lengths.shape)


@pytest.mark.parametrize("seed", range(5))
def test_what_bends_one_section_is_led_as_the_inverse_of_the_mode_says(seed: int) -> None:
    arm = ARMS["paper"]
    lengths, rates, changes = motion(arm, seed)
    kinematics, h = CompiledKinematics(arm), 1e-3

    def tip(time_s: float) -> Array:
        moved = lengths + time_s * rates + 0.5 * time_s**2 * changes
        return kinematics.evaluate(moved).position_m.copy()

    velocity = (tip(h) - tip(-h)) / (2.0 * h)
    acceleration = (tip(h) - 2.0 * tip(0.0) + tip(-h)) / h**2
    ahead = lengths + mean_free(BY_RATE_S * rates + BY_ACCELERATION_S2 * changes)
    exact_m = kinematics.evaluate(ahead).position_m.copy() - tip(0.0)
    # The law's lengths are those that are led.
    way_m = INVERSES["paper"].way_m(velocity, acceleration, ahead)
    assert way_m == pytest.approx(exact_m, abs=0.03 * float(np.linalg.norm(exact_m)))


@given(seed=st.integers(0, 2**32 - 1), velocity=vectors, acceleration=vectors)
def test_the_way_is_finite_and_bounded_everywhere(
    seed: int, velocity: Array, acceleration: Array
) -> None:
    rng = np.random.default_rng(seed)
    for name, arm in ARMS.items():
        way_m = INVERSES[name].way_m(velocity, 10.0 * acceleration, random_lengths(arm, rng))
        assert np.isfinite(way_m).all()
        assert np.linalg.norm(way_m) < 2.0 * arm.max_length_m
