"""Tick and message: both ways, for one section and for several, unknown arrays included."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.logs.rings.tick import new_tick, state_from_tick, tick_dtype, ticks_from_states
from pneuarm.logs.schema.pneuarm_pb2 import ArmState

FIELDS = list(ArmState.DESCRIPTOR.fields)
ARRAYS = [field.name for field in FIELDS if field.is_repeated]
every_size = pytest.mark.parametrize("n_sections", [1, 3])


def random_tick(n_sections: int, seed: int, unknown: float = 0.3) -> np.ndarray:
    """Tick with every scalar set and every array known or unknown."""
    rng = np.random.default_rng(seed)
    tick = new_tick(n_sections)
    for field in FIELDS:
        if field.is_repeated:
            if rng.random() > unknown:
                tick[field.name] = rng.standard_normal(tick[field.name].shape)
        elif field.enum_type is not None:
            tick[field.name] = rng.choice([value.number for value in field.enum_type.values])
        elif field.cpp_type == field.CPPTYPE_DOUBLE:
            tick[field.name] = rng.standard_normal()
        elif field.name != "n_sections":
            tick[field.name] = rng.integers(0, 2**31)
    return tick


@every_size
def test_a_tick_has_a_field_for_every_field_of_the_message(n_sections: int) -> None:
    assert tick_dtype(n_sections).names == tuple(field.name for field in FIELDS)


@every_size
@pytest.mark.parametrize(
    ("name", "shape_of"),
    [
        ("pressure_sent_pa", lambda n: (n, 3)),
        ("length_commanded_m", lambda n: (n, 3)),
        ("tip_true_position_m", lambda n: (3,)),
        ("target_position_m", lambda n: (3,)),
        ("tip_estimated_orientation_xyzw", lambda n: (4,)),
        ("tip_offset_m", lambda n: (3,)),
        ("target_error_m", lambda n: ()),
        ("sequence", lambda n: ()),
    ],
)
def test_a_field_has_the_shape_that_the_message_says(
    n_sections: int, name: str, shape_of: Callable[[int], tuple[int, ...]]
) -> None:
    assert new_tick(n_sections)[name].shape == shape_of(n_sections)


@every_size
@given(seeds=st.lists(st.integers(0, 2**32 - 1), max_size=4))
def test_ticks_come_back_from_their_messages(n_sections: int, seeds: list[int]) -> None:
    ticks = [random_tick(n_sections, seed) for seed in seeds]
    back = ticks_from_states([state_from_tick(tick) for tick in ticks], n_sections)
    assert back.shape == (len(seeds),)
    assert back.dtype == tick_dtype(n_sections)
    for tick, returned in zip(ticks, back, strict=True):
        assert tick.tobytes() == returned.tobytes() or all(
            np.array_equal(tick[name], returned[name], equal_nan=name in ARRAYS)
            for name in tick.dtype.names or ()
        )


@every_size
@given(seed=st.integers(0, 2**32 - 1))
def test_messages_come_back_through_the_wire_and_the_tick(n_sections: int, seed: int) -> None:
    state = state_from_tick(random_tick(n_sections, seed))
    received = ArmState.FromString(state.SerializeToString())
    (tick,) = ticks_from_states([received], n_sections)
    assert state_from_tick(tick) == state


@every_size
def test_a_new_tick_knows_its_size_and_nothing_else(n_sections: int) -> None:
    assert state_from_tick(new_tick(n_sections)) == ArmState(n_sections=n_sections)


@every_size
@pytest.mark.parametrize("name", ARRAYS)
def test_an_array_that_is_not_known_is_empty_in_the_message_and_nan_in_the_tick(
    n_sections: int, name: str
) -> None:
    tick = random_tick(n_sections, 0, unknown=0.0)
    tick[name] = np.nan
    state = state_from_tick(tick)
    assert [array for array in ARRAYS if not getattr(state, array)] == [name]
    (back,) = ticks_from_states([state], n_sections)
    assert np.isnan(back[name]).all()


@pytest.mark.parametrize("chamber", [0, 1, 2])
def test_an_array_known_in_part_keeps_what_is_known(chamber: int) -> None:
    tick = new_tick(1)
    lengths = np.array([0.2, 0.21, 0.22])
    lengths[chamber] = np.nan  # one chamber has no sensor
    tick["length_measured_m"] = lengths
    state = state_from_tick(tick)
    np.testing.assert_array_equal(list(state.length_measured_m), lengths)
    (back,) = ticks_from_states([state], 1)
    np.testing.assert_array_equal(back["length_measured_m"], [lengths])


def test_chambers_stand_row_by_row() -> None:
    tick = new_tick(3)
    tick["pressure_sent_pa"] = np.arange(9.0).reshape(3, 3)
    state = state_from_tick(tick)
    assert list(state.pressure_sent_pa) == list(range(9))
    (back,) = ticks_from_states([state], 3)
    np.testing.assert_array_equal(back["pressure_sent_pa"][1], [3.0, 4.0, 5.0])


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("sequence", 2**64 - 1),
        ("time_unix_ns", -(2**63)),
        ("time_unix_ns", 2**63 - 1),
        ("binding_limits", 2**32 - 1),
        ("wake_latency_s", 5e-324),
    ],
)
def test_the_extremes_of_every_type_survive(name: str, value: float) -> None:
    tick = new_tick(1)
    tick[name] = value
    state = state_from_tick(tick)
    assert getattr(state, name) == value
    assert ticks_from_states([state], 1)[0][name] == value


def test_a_tick_survives_as_bytes_of_one_fixed_size() -> None:
    tick = random_tick(3, 1)
    read = np.frombuffer(tick.tobytes(), dtype=tick_dtype(3))[0]
    assert state_from_tick(read) == state_from_tick(tick)
    assert len(tick.tobytes()) == tick_dtype(3).itemsize


def test_a_message_of_another_arm_does_not_become_a_tick() -> None:
    state = state_from_tick(random_tick(3, 2, unknown=0.0))
    with pytest.raises(ValueError, match="shape"):
        ticks_from_states([state], 1)
