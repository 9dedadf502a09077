"""What a hold keeps lies inside the limits, whatever was measured, wanted or added to it."""

from dataclasses import replace

import numpy as np
import pytest

from pneuarm.controllers.actuation.valve_lead import ValveLead
from pneuarm.controllers.arm.arm import Array, Response
from pneuarm.controllers.feedback.observer import FeedbackSettings
from pneuarm.service.control.setpoints import Setpoints
from tools.rig.arms import PAPER_SECTION, paper_arm

ARM = paper_arm()
LOW, HIGH = PAPER_SECTION.pressure_min_pa, PAPER_SECTION.pressure_max_pa
DT_S = 0.005
NO_LEAD = ValveLead(Response(filling_lag_s=0.0, exhausting_lag_s=0.0))
#: Beyond the limits below and above, and between them.
BEYOND = np.array([[LOW - 5e4, HIGH + 5e4, 1e4]])
WITHIN = np.array([[LOW, HIGH, 1e4]])


def setpoints(lag_s: float = 0.06) -> Setpoints:
    response = Response(filling_lag_s=lag_s, exhausting_lag_s=lag_s)
    return Setpoints(ARM, FeedbackSettings(), ValveLead(response))


def step(own: Setpoints, wanted_pa: Array, now_s: float = 0.0) -> Array:
    return own.step(wanted_pa, DT_S, now_s, False, None, False)


def test_a_start_at_measured_pressures_beyond_the_limits_keeps_the_limits() -> None:
    own = setpoints()
    own.start(BEYOND)
    assert np.array_equal(own.held_pa, WITHIN)


def test_a_start_without_a_measurement_goes_on_from_what_is_held() -> None:
    own = setpoints()
    own.start(WITHIN)
    own.start(None)
    assert np.array_equal(own.held_pa, WITHIN)


@pytest.mark.parametrize(
    "wanted_pa",
    [BEYOND, np.where(np.arange(3) == 1, np.nan, WITHIN), np.where(np.arange(3), np.inf, WITHIN)],
    ids=["beyond", "nan", "inf"],
)
def test_what_the_guard_has_to_see_is_passed_on_and_not_held(wanted_pa: Array) -> None:
    own = setpoints()
    kept = np.array([[1e4, 2e4, -1e4]])
    step(own, kept)
    assert np.array_equal(own.held_pa, kept)
    np.testing.assert_array_equal(step(own, wanted_pa), wanted_pa)
    assert np.array_equal(own.held_pa, kept)
    assert np.isfinite(step(own, kept)).all()


def test_a_lead_leaves_no_limit_and_is_not_held() -> None:
    own = setpoints()
    first, second = WITHIN - [[-1e3, 1e3, 0.0]], WITHIN
    step(own, first)
    sent = step(own, second)
    assert np.array_equal(own.held_pa, second)
    assert (sent >= LOW).all()
    assert (sent <= HIGH).all()


@pytest.mark.parametrize(("rate_pa_s", "lag_s"), [(4e3, 0.4), (-4e3, 1.6)])
def test_a_lead_makes_slow_and_lopsided_valves_as_quick_as_it_says(
    rate_pa_s: float, lag_s: float
) -> None:
    lead = ValveLead(Response(filling_lag_s=0.4, exhausting_lag_s=1.6))
    remaining_s = lead.behind.slower_lag_s
    assert lead.behind.filling_lag_s == remaining_s < 0.25
    wanted, pressure, went = 0.0, 0.0, 3.0
    lead.sent_pa(np.zeros((1, 3)), DT_S)
    for _ in range(round(went / DT_S)):
        wanted += rate_pa_s * DT_S
        sent = float(lead.sent_pa(np.full((1, 3), wanted), DT_S)[0, 0])
        for _ in range(20):
            slow_s = 0.4 if sent > pressure else 1.6
            pressure += DT_S / 20 * (sent - pressure) / slow_s
    assert wanted - pressure == pytest.approx(rate_pa_s * remaining_s, rel=0.1)
    assert abs(sent - pressure) == pytest.approx(abs(rate_pa_s) * lag_s, rel=0.1)


def test_a_lead_is_ahead_of_what_is_wanted_and_what_is_wanted_is_held() -> None:
    own = setpoints()
    step(own, np.zeros((1, 3)))
    rising = np.full((1, 3), 1e3)
    assert (step(own, rising) > rising).all()
    assert np.array_equal(own.held_pa, rising)


def test_without_dither_lag_or_motion_what_is_wanted_is_what_is_sent() -> None:
    own = Setpoints(ARM, replace(FeedbackSettings(), dither_pa=0.0), NO_LEAD)
    for pressure in (0.0, 1e3, 2e3):
        wanted = np.full((1, 3), pressure)
        np.testing.assert_allclose(step(own, wanted), wanted)
