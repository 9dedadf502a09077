"""What is drawn for a seed, and the record of it."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from pneuarm.hardware.simulator.adapter import SimulatedArm
from pneuarm.hardware.simulator.parameters import NOMINAL, Valves, draw
from tests.hardware.simulator.test_simulator import PAPER

each_valves = pytest.mark.parametrize("valves", NOMINAL)


@each_valves
def test_every_parameter_is_varied_by_up_to_20_percent(valves: Valves) -> None:
    """Over seeds each comes near both ends and never beyond; segments stay what they are."""
    drawn = [draw(NOMINAL[valves], seed, 3) for seed in range(60)]
    records = [arm.as_dict() for arm in drawn]
    for name, nominal in asdict(NOMINAL[valves]).items():
        factors = np.array([record[name] for record in records]) / nominal
        if name in ("segments_per_section", "lowest_mode_hz"):
            assert (factors == 1.0).all()
        else:
            assert 0.8 <= factors.min() < 0.86
            assert 1.14 < factors.max() <= 1.2
    stiffness = np.array([arm.stiffness_factors for arm in drawn])
    assert 0.8 <= stiffness.min() < 0.82
    assert 1.18 < stiffness.max() <= 1.2
    assert (np.ptp(stiffness, axis=1) > 0.0).all()


@each_valves
def test_a_seed_has_the_same_body_whatever_its_valves_are(valves: Valves) -> None:
    """So that valves can be compared, and nothing else."""
    body = [name for name in asdict(NOMINAL["servo"]) if not name.startswith("valve_")]
    for seed in range(5):
        servo, other = (draw(NOMINAL[name], seed, 3) for name in ("servo", valves))
        assert other.stiffness_factors == servo.stiffness_factors
        assert all(getattr(other.values, name) == getattr(servo.values, name) for name in body)


@each_valves
def test_the_record_of_a_session_is_enough_to_repeat_it(valves: Valves) -> None:
    """The seed and the nominal values stand in it, and the drawn arm's own lowest mode."""
    nominal = replace(NOMINAL[valves], lowest_mode_hz=2.3)
    record = SimulatedArm(PAPER, nominal, 11).drawn.as_dict()
    assert all(isinstance(value, float) for value in record.values())
    fields = asdict(nominal)
    recorded = {name: type(fields[name])(record[f"nominal_{name}"]) for name in fields}
    again = SimulatedArm(PAPER, type(nominal)(**recorded), int(record["seed"]))
    assert again.drawn.as_dict() == record
    assert 1.5 < record["lowest_mode_hz"] < 3.0
    assert record["lowest_mode_hz"] != 2.3
