"""The loop with a calibrated arm: what holds without load and hysteresis holds with them."""

import numpy as np

from pneuarm.controllers.targets.targets import PositionTarget, PressuresTarget
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.modes.mode import Mode, ModeEvent
from tools.rig.simulated import Bench, configuration_of, true_tip


def calibrated_configuration() -> Configuration:
    configuration = configuration_of()
    tables = configuration.model_dump(exclude_none=True)
    tables["simulator"]["arm"] = configuration.arm.model_dump()
    calibrated = {
        "coupling": [[1.02, 0.01, -0.03], [0.0, 0.97, 0.02], [0.01, -0.01, 1.01]],
        "hysteresis_bar": 0.04,
        "bending_compliance_deg_per_n_m": 120.0,
        "axial_compliance_mm_per_n": 1.0,
    }
    tables["arm"]["sections"] = [tables["arm"]["sections"][0] | calibrated]
    return Configuration.model_validate(tables)


def active() -> Bench:
    return Bench(configuration=calibrated_configuration()).activate()


def test_arming_does_not_move_the_tip() -> None:
    bench = Bench(configuration=calibrated_configuration()).get_ready()
    before = true_tip(bench.tick())
    assert bench.ask(ModeEvent.ENABLE).accepted
    after = true_tip(bench.run(1.0))
    assert np.linalg.norm(after - before) < 1e-3


def test_going_on_from_hold_sends_what_was_sent() -> None:
    bench = active()
    bench.run(1.5, PositionTarget(np.array([0.05, -0.03, 0.19])))
    assert bench.ask(ModeEvent.HOLD).accepted
    held = bench.newest["pressure_sent_pa"].copy()
    assert bench.mode == Mode.HOLD
    assert bench.ask(ModeEvent.ENABLE).accepted
    np.testing.assert_allclose(bench.run(0.1)["pressure_sent_pa"], held, atol=1.0)


def test_no_pressure_jumps_where_a_chamber_turns() -> None:
    bench = active()
    for x in (0.04, -0.04, 0.02):
        bench.run(0.8, PositionTarget(np.array([x, 0.0, 0.2])))
    sent = bench.ticks()["pressure_sent_pa"]
    slew = bench.arm.sections[0].pressure_slew_max_pa_s
    assert np.abs(np.diff(sent, axis=0)).max() <= slew / 500.0 * (1.0 + 1e-9)
    assert bench.newest["guard_interventions"] <= len(sent) // 4


def test_pressures_that_are_asked_for_are_sent() -> None:
    bench = active()
    bench.run(1.0, PositionTarget(np.array([0.04, 0.0, 0.2])))
    asked = np.array([[0.2e5, -0.1e5, 0.15e5]])
    newest = bench.run(1.5, PressuresTarget(asked))
    np.testing.assert_allclose(newest["pressure_sent_pa"], asked, atol=50.0)
