"""The trials of `pneuarm learn` in the real loop, on simulated time: nearer, and never astray."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import LearningDiverges, TargetRejected, TrialLost
from pneuarm.controllers.learning.course import MARGIN_S, Course
from pneuarm.controllers.learning.learning import Learning, Trial
from pneuarm.controllers.targets.trajectory import TrajectoryTarget
from pneuarm.hardware.interface import Hardware
from pneuarm.hardware.simulator.adapter import SimulatedArm
from pneuarm.hardware.simulator.parameters import NOMINAL, Valves
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.devices import registry
from pneuarm.service.learning.drive import bound_m
from pneuarm.service.learning.learn import learn
from pneuarm.service.learning.recorded import measured_tip
from tools.bench import learning as bench
from tools.bench.rig import CameraRig
from tools.rig.simulated import configuration_of

#: Of the preset's response: dead time, and the lag that the valve lead leaves.
AHEAD_S = 0.015


@pytest.mark.parametrize("frequency_hz", [pytest.param(0.25, marks=pytest.mark.slow), 0.5])
def test_ten_trials_of_a_circle_make_its_error_half_or_less(frequency_hz: float) -> None:
    wanted = bench.circle(frequency_hz)
    learning, arm = bench.repeated(bench.arm_with("servo", 0), wanted, trials=10)
    errors = [trial.rms_m for trial in learning.trials]
    assert errors[-1] < 0.5 * errors[0]
    assert learning.best.max_m < 0.5 * learning.trials[0].max_m
    # Down to what does not come again (noise, creep), and then no further up than that.
    floor_m = 0.1 * errors[0]
    assert all(
        after < before or after < floor_m + min(errors) for before, after in pairwise(errors)
    )
    assert np.linalg.norm(learning.best.offset_m, axis=1).max() <= bound_m(
        bench.arm_with("servo", 0)
    )
    # What was kept does the same again, and to the true tip.
    arm.follow(learning.course.shifted(learning.best.offset_m, 99))
    ticks = arm.rig.ticks()
    followed = ticks[np.flatnonzero(ticks["target_kind"] == pb.TRAJECTORY)[0] :]
    time_s = np.arange(len(followed)) / bench.RATE_HZ - AHEAD_S - MARGIN_S
    inside = (time_s >= 0.0) & (time_s <= wanted.duration_s)
    wanted_m = np.array([wanted.at(t).position for t in time_s[inside].tolist()])
    error_m = np.linalg.norm(followed["tip_true_position_m"][inside] - wanted_m, axis=1)
    assert np.sqrt((error_m**2).mean()) < 1.3 * learning.best.rms_m


def test_slow_valves_whose_lag_is_half_known_are_learnt_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    known = bench.arm_with("servo", 0)
    response = known.arm.response.model_copy(
        update={"filling_lag_ms": 200.0, "exhausting_lag_ms": 200.0}
    )
    slow = known.model_copy(update={"arm": known.arm.model_copy(update={"response": response})})

    def lagging(configuration: Configuration, _: object) -> Hardware:
        valves = replace(NOMINAL["servo"], valve_time_constant_s=0.35)
        return SimulatedArm(configuration.build_simulated_arm(), valves, 0)

    monkeypatch.setattr(registry, "build", lagging)
    learning, _ = bench.repeated(slow, bench.circle(0.25), trials=6)
    assert learning.law is not None
    assert learning.law.advance_s > 0.15
    assert learning.best.rms_m < 0.5 * learning.trials[0].rms_m


@pytest.mark.slow
@pytest.mark.parametrize(("valves", "frequency_hz"), [("itv", 0.1), ("onoff", 0.25)])
def test_slow_valves_that_the_configuration_knows_are_learnt_too(
    valves: Valves, frequency_hz: float
) -> None:
    arm = bench.arm_with(valves, 0)
    learning, _ = bench.repeated(arm, bench.circle(frequency_hz, turns=1.0), trials=4)
    assert learning.best.rms_m < 0.5 * learning.trials[0].rms_m
    assert learning.best.max_m < 0.5 * learning.trials[0].max_m


def test_what_comes_differently_every_time_ends_in_words() -> None:
    course = Course(bench.circle(0.25))
    learning, pushed = Learning(course, 0.04, 2.2), iter((0.002, 0.03, -0.03))

    def follow(target: TrajectoryTarget) -> Array:
        return course.wanted_m + np.array([0.0, 0.0, next(pushed)])

    told: list[Trial] = []
    with pytest.raises(LearningDiverges, match="calibrate"):
        learn(learning, 10, follow, told.append)
    assert len(told) == 3
    assert not learning.has_learnt


def test_a_refused_trajectory_is_tried_with_less_and_then_ends_the_learning() -> None:
    course = Course(bench.circle(0.25))
    learning, asked = Learning(course, 0.04, 2.2), list[float]()

    def follow(target: TrajectoryTarget) -> Array:
        offset = np.array(target.positions_m) - course.shifted(0.0 * course.wanted_m).positions_m
        asked.append(float(np.abs(offset).max()))
        if asked[-1] > 0.001:
            raise TargetRejected("too far")
        return course.wanted_m - [0.0, 0.0, 0.01]

    assert "too far" in learn(learning, 10, follow)
    assert asked[0] == 0.0
    assert asked[2] == pytest.approx(0.5 * asked[1], rel=1e-6)
    assert len(asked) == 3
    with pytest.raises(TargetRejected):
        learn(Learning(course, 0.04, 2.2), 3, lambda target: _refuse())


def _refuse() -> Array:
    raise TargetRejected("too far")


def test_every_trial_has_an_id_of_its_own() -> None:
    course, seen = Course(bench.circle(0.25)), list[int]()

    def follow(target: TrajectoryTarget) -> Array:
        seen.append(target.id)
        return course.wanted_m

    learn(Learning(course, 0.04, 2.2), 4, follow, first_id=2**16 - 2)
    assert seen == [2**16 - 2, 2**16 - 1, 0, 1]


@pytest.mark.parametrize(("in_a_row", "ends"), [(2, False), (3, True)])
def test_a_trial_that_was_not_measured_is_repeated_but_not_for_ever(
    in_a_row: int, ends: bool
) -> None:
    course, learning = Course(bench.circle(0.25)), Learning(Course(bench.circle(0.25)), 0.04, 2.2)
    shows = iter(2 * [True, *in_a_row * [False]] + [True])

    def follow(target: TrajectoryTarget) -> Array:
        if not next(shows):
            raise TrialLost("out of sight")
        return course.wanted_m

    if ends:
        with pytest.raises(TrialLost):
            learn(learning, 3, follow)
    else:
        learn(learning, 3, follow)
    assert len(learning.trials) == (1 if ends else 3)


@pytest.mark.parametrize("delay_s", [0.0, 0.1])
def test_a_tip_counts_for_the_time_at_which_it_was_seen(delay_s: float) -> None:
    """A camera that is late by what the configuration says shows the same tip."""
    configuration = configuration_of("paper", 250.0)
    feedback = configuration.feedback.model_copy(update={"camera_delay_ms": 1e3 * delay_s})
    configuration = configuration.model_copy(update={"feedback": feedback})
    rig = CameraRig(configuration, delay_s=delay_s, noise_m=0.0).activate()
    wanted = bench.circle(0.5)
    course = Course(wanted)
    sent = course.shifted(0.0 * course.wanted_m, 1)
    rig.to(np.array(sent.positions_m[0]), 3.0)
    rig.forget()
    ticks = rig.run(course.duration_s + 0.3, sent)
    tip = measured_tip(ticks, course, configuration)
    begin = np.flatnonzero(ticks["target_kind"] == pb.TRAJECTORY)[0]
    true_s = (np.arange(len(ticks)) - begin) / 250.0 - AHEAD_S
    columns = ticks["tip_true_position_m"].T
    true = np.stack([np.interp(course.times_s, true_s, column) for column in columns], axis=1)
    np.testing.assert_allclose(tip[:-10], true[:-10], atol=2e-4)


def test_ticks_of_something_else_teach_nothing() -> None:
    rig = CameraRig(configuration_of("paper", 250.0)).activate()
    ticks = rig.to(np.array([0.0, 0.0, 0.2]), 0.5)
    with pytest.raises(TrialLost, match="did not follow"):
        measured_tip(ticks, Course(bench.circle(0.5)), configuration_of("paper"))
