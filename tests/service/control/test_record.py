"""The record is a function of the tick's values: of all of them, and of nothing else."""

import numpy as np
import pytest

from pneuarm.controllers.targets.targets import PositionTarget
from pneuarm.hardware.guard import Intervention
from pneuarm.logs.rings.tick import pack_tick, tick_dtype
from pneuarm.logs.schema.pneuarm_pb2 import ArmState
from pneuarm.service.control.record import GuardCounts, Tick, record_of, values_of
from tools.rig.simulated import Bench


@pytest.fixture(scope="module")
def tick() -> Tick:
    bench = Bench().activate()
    bench.run(0.2, PositionTarget(np.array([0.03, 0.01, 0.2])))
    return bench.loop._tick


TOOL_M = np.array([0.0, 0.0, 0.01])


def test_every_field_of_the_message_has_a_value_and_no_other(tick: Tick) -> None:
    assert set(values_of(tick, TOOL_M)) == {field.name for field in ArmState.DESCRIPTOR.fields}


def test_the_same_values_give_the_same_record_whatever_came_between(tick: Tick) -> None:
    record = record_of(tick, TOOL_M)
    other = tick._replace(measured_pa=None, sent_pa=None, estimate=None, target=None)
    assert record_of(other, TOOL_M) != record
    assert record_of(tick, TOOL_M) == record


def test_the_record_shares_no_memory_with_the_values(tick: Tick) -> None:
    mine = tick._replace(commanded_pa=tick.commanded_pa.copy())
    record = record_of(mine, TOOL_M)
    before = bytes(record)
    mine.commanded_pa[:] = 1.0
    assert record == before


def test_what_is_not_known_is_not_a_number(tick: Tick) -> None:
    unknown = tick._replace(measured_pa=None, sent_pa=None, estimate=None, measurement=None)
    read = np.frombuffer(record_of(unknown, TOOL_M), tick_dtype(1))[0]
    for name in (
        "pressure_measured_pa",
        "pressure_sent_pa",
        "length_estimated_m",
        "length_measured_m",
        "tip_true_position_m",
        "tip_estimated_orientation_xyzw",
    ):
        assert np.isnan(read[name]).all()


def test_a_record_holds_its_values(tick: Tick) -> None:
    values = values_of(tick, TOOL_M)
    read = np.frombuffer(record_of(tick, TOOL_M), tick_dtype(1))[0]
    for name, value in values.items():
        if value is not None:
            np.testing.assert_array_equal(read[name].reshape(np.shape(value)), value)


def test_a_value_that_is_missing_or_of_another_size_is_refused(tick: Tick) -> None:
    values = values_of(tick, TOOL_M)
    with pytest.raises(KeyError, match="supply_pa"):
        pack_tick(1, {name: value for name, value in values.items() if name != "supply_pa"})
    with pytest.raises(ValueError, match="length_commanded_m"):
        pack_tick(1, values | {"length_commanded_m": np.zeros((2, 3))})


def test_the_guards_counts_go_on_and_its_intervention_does_not() -> None:
    counts = GuardCounts().after(Intervention.RANGE | Intervention.SLEW).after(0)
    assert (counts.intervention, counts.ticks) == (0, 1)
    assert dict(zip(Intervention, counts.by_kind, strict=True))[Intervention.SLEW] == 1
    assert counts.after(0) is counts
