"""The mode machine over all modes and events, against what is expected, written out."""

import pytest

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.modes import mode
from pneuarm.service.modes.mode import VENTED_MODES, Mode, ModeEvent, next_mode, why_not

#: For each event, the mode after idle, ready, active, hold, fault and estop; "-" where refused.
EXPECTED = {
    #                 idle    ready   active  hold    fault   estop
    "VENTED":         "READY  -       -       -       -       -",
    "ENABLE":         "-      ACTIVE  -       ACTIVE  -       -",
    "HOLD":           "-      -       HOLD    HOLD    -       -",
    "VENT":           "IDLE   READY   IDLE    IDLE    -       -",
    "RESET":          "-      -       -       -       IDLE    IDLE",
    "ESTOP":          "ESTOP  ESTOP   ESTOP   ESTOP   ESTOP   ESTOP",
    "FAULT":          "FAULT  FAULT   FAULT   FAULT   FAULT   -",
    "TARGET_STALE":   "-      -       HOLD    -       -       -",
    "LEASE_LOST":     "-      -       HOLD    -       -       -",
    "LEASE_RELEASED": "-      -       HOLD    -       -       -",
    "HOLD_TIMEOUT":   "-      -       IDLE    IDLE    -       -",
    "GATEWAY_SILENT": "-      -       HOLD    -       -       -",
    "GATEWAY_LOST":   "-      -       IDLE    IDLE    -       -",
    "DISK_FULL":      "-      -       HOLD    -       -       -",
    "DISK_STILL_FULL": "-     -       IDLE    IDLE    -       -",
    "FAULT_HOLD":     "-      -       HOLD    -       -       -",
}  # fmt: skip
COLUMNS = ("IDLE", "READY", "ACTIVE", "HOLD", "FAULT", "ESTOP")
PAIRS = [(mode, event) for mode in Mode for event in ModeEvent]
LATCHED = (Mode.FAULT, Mode.ESTOP)


def test_the_expectations_cover_every_mode_and_event() -> None:
    assert set(EXPECTED) == set(ModeEvent.__members__)
    assert tuple(Mode.__members__) == COLUMNS


@pytest.mark.parametrize(("mode", "event"), PAIRS)
def test_every_mode_and_event_goes_where_it_should(mode: Mode, event: ModeEvent) -> None:
    after = EXPECTED[event.name].split()[COLUMNS.index(mode.name)]
    assert next_mode(mode, event) == (None if after == "-" else Mode[after])


@pytest.mark.parametrize("mode", Mode)
def test_the_stop_comes_from_everywhere(mode: Mode) -> None:
    assert next_mode(mode, ModeEvent.ESTOP) == Mode.ESTOP


@pytest.mark.parametrize(("mode", "event"), PAIRS)
def test_only_reset_leaves_fault_and_stop_and_it_leads_to_idle(
    mode: Mode, event: ModeEvent
) -> None:
    if mode in LATCHED:
        after = next_mode(mode, event)
        assert (after == Mode.IDLE) == (event == ModeEvent.RESET)
        assert after in (None, Mode.IDLE, *LATCHED)


@pytest.mark.parametrize(("mode", "event"), PAIRS)
def test_air_comes_into_the_arm_only_by_enabling(mode: Mode, event: ModeEvent) -> None:
    after = next_mode(mode, event)
    if mode in VENTED_MODES and after is not None and after not in VENTED_MODES:
        assert (event, after) == (ModeEvent.ENABLE, Mode.ACTIVE)
        assert mode == Mode.READY


def test_active_is_entered_by_nothing_but_enable() -> None:
    entering = {event for mode, event in PAIRS if next_mode(mode, event) == Mode.ACTIVE}
    assert entering == {ModeEvent.ENABLE}


@pytest.mark.parametrize(("mode", "event"), PAIRS)
def test_a_refusal_names_the_mode_in_one_sentence(mode: Mode, event: ModeEvent) -> None:
    if next_mode(mode, event) is None:
        reason = why_not(mode, event)
        assert reason.startswith(f"mode is {mode.name.lower()}: ")
        assert "\n" not in reason


@pytest.mark.parametrize(
    ("mode", "event", "words"),
    [
        (Mode.IDLE, ModeEvent.ENABLE, "venting"),
        (Mode.FAULT, ModeEvent.ENABLE, "reset first"),
        (Mode.ESTOP, ModeEvent.ENABLE, "reset first"),
        (Mode.ACTIVE, ModeEvent.ENABLE, "already"),
        (Mode.READY, ModeEvent.HOLD, "nothing to hold"),
        (Mode.ESTOP, ModeEvent.VENT, "vented already"),
        (Mode.ACTIVE, ModeEvent.RESET, "reset means nothing now"),
    ],
)
def test_a_refusal_says_what_to_do(mode: Mode, event: ModeEvent, words: str) -> None:
    assert words in why_not(mode, event)


def test_modes_are_numbered_as_on_the_wire() -> None:
    wire = {name: number for name, number in pb.Mode.items() if number}
    assert wire == {mode.name: mode.value for mode in Mode}


@pytest.mark.parametrize(("arrow", "after"), [("(a)", Mode.HOLD), ("(b)", Mode.IDLE)])
def test_the_drawing_names_every_event_of_an_arrow_out_of_active(arrow: str, after: Mode) -> None:
    lines = (mode.__doc__ or "").splitlines()
    (named,) = (line.strip() for line in lines if line.strip().startswith(arrow))
    drawn = {ModeEvent[name.strip()] for name in named.removeprefix(arrow).split(",")}
    assert drawn == {event for event in ModeEvent if next_mode(Mode.ACTIVE, event) == after}
