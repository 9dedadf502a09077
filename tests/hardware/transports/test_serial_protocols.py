"""The two serial protocols, bytes against values; and parsers that nothing can surprise."""

import json
import math
import random
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.hardware import ctrl_p, esp32
from pneuarm.hardware.channels import Channels, StepCommand
from pneuarm.hardware.ctrl_p.protocol import Echo, Kind, Mode, Telemetry
from pneuarm.hardware.esp32.protocol import Feedback, Remark
from tools.rig.arms import TABLE1_SECTION, paper_arm, trunk_arm

#: Beginnings and middles of real lines, which reach deeper into a parser than noise does.
PIECES = [
    b"_NEW UNITS: ",
    b"_MODE: 0\t",
    b"_",
    b":",
    b"12345\t0\t",
    b"12345\t1\t",
    b"\t2\t",
    b"1.5\t",
    b"-3e400",
    b"nan",
    b"\xff\xfe",
    b'{"pressure_1":',
    b'"target_pressure_2":1.5,',
    b"[" * 50,
    b"}",
    b'{"status":"error"}',
    b"1" * 5000,
    b"null",
]
LINES = st.one_of(
    st.binary(max_size=200),
    st.lists(st.one_of(st.sampled_from(PIECES), st.binary(max_size=4)), max_size=12).map(b"".join),
)


def assert_no_surprise(line: bytes) -> None:
    """Whatever comes, it means something of a known kind, or nothing."""
    said = ctrl_p.protocol.parse(line)
    assert said is None or isinstance(said, Telemetry | Echo)
    if isinstance(said, Telemetry):
        assert not any(map(math.isinf, said.values_kpa))
    if isinstance(said, Echo):
        ctrl_p.protocol.modes(said)
        ctrl_p.protocol.is_in_kpa(said)
    heard = esp32.protocol.parse(line)
    assert heard is None or isinstance(heard, Feedback | Remark)


@settings(max_examples=500, deadline=None)
@given(LINES)
@example(b'{"pressure_1":' + b"9" * 5000 + b"}")
@example(b"[" * 100_000)
def test_no_line_surprises_a_parser(line: bytes) -> None:
    assert_no_surprise(line)


def test_ten_thousand_broken_lines_surprise_no_parser() -> None:
    """Pieces of real lines and noise, shuffled; with the seed, the same ones always."""
    chance = random.Random(3)
    for _ in range(10_000):
        pieces = chance.choices(PIECES, k=chance.randrange(8))
        pieces.append(chance.randbytes(chance.randrange(6)))
        chance.shuffle(pieces)
        assert_no_surprise(b"".join(pieces))


def test_ctrl_p_commands_are_those_of_the_manual() -> None:
    """All channels, always; venting ends in the mode in which a valve is moved directly."""
    assert ctrl_p.protocol.setpoints([12345.0, 0.0, -6.0]) == b"set;0;12.35;0.00;-0.01\n"
    assert ctrl_p.protocol.vent(2) == (b"set;0;0.00;0.00\n", b"valve;-1\n", b"mode;0\n")
    assert ctrl_p.protocol.mode(Mode.PRESSURE) == b"mode;1\n"
    assert ctrl_p.protocol.USE_KPA == b"units;1\n"
    assert ctrl_p.protocol.largest_pressure(1.5e5) == b"maxp;150.00\n"
    assert ctrl_p.protocol.telemetry_period(0.02) == b"time;20\n"


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        (b"5120\t0\t1.000\t-2.500", Telemetry(Kind.SETPOINTS, (1.0, -2.5))),
        (b"5120\t1\t0.998\t-2.4\t\r", Telemetry(Kind.MEASURED, (0.998, -2.4))),
        (b"5120\t2\t250.5\r", Telemetry(Kind.SUPPLY, (250.5,))),
        (b"_NEW UNITS: kPa\tkPa\r", Echo("UNITS", ("kPa", "kPa"), True)),
        (b"_MODE: 1\t1\t1\t", Echo("MODE", ("1", "1", "1"), False)),
        (b"_UNREC: Unrecognized Command", Echo("UNREC", ("Unrecognized", "Command"), False)),
        (b"5120\t3\t1.0", None),
        (b"5120\t1\t", None),
        (b"5120\t1\t1.0.0", None),
        (b"-5\t1\t1.0", None),
        (b"5120\t1\t1e300", None),
        (b"5120\t1\tinf", None),
        (b"_NEW UN", None),
        (b"", None),
        (b"\xff5120\t1\t1.0", None),
    ],
)
def test_ctrl_p_lines_mean_what_the_manual_says(
    line: bytes, expected: Telemetry | Echo | None
) -> None:
    assert ctrl_p.protocol.parse(line) == expected


def test_ctrl_p_units_are_right_only_where_both_are_kpa() -> None:
    """What is sent has a unit of its own, and so has what is received."""
    for text, right in (("kPa\tkPa", True), ("KPA\tkpa", True), ("kPa\tpsi", False), ("", False)):
        echo = ctrl_p.protocol.parse(f"_NEW UNITS: {text}".encode())
        assert isinstance(echo, Echo)
        assert ctrl_p.protocol.is_in_kpa(echo) == right


FEEDBACK = {
    "imu_roll": 1.5,
    "imu_pitch": -2.0,
    "imu_yaw": 179.0,
    **{f"potentiometer_{n}": 200.0 + n for n in range(1, 7)},
    **{f"pressure_{n}": 5.0 + n for n in range(1, 4)},
    **{f"target_pressure_{n}": 6.0 + n for n in range(1, 4)},
}


def test_esp32_feedback_in_its_units() -> None:
    said = esp32.protocol.parse(json.dumps(FEEDBACK).encode())
    assert said == Feedback(
        (6.0, 7.0, 8.0), (7.0, 8.0, 9.0), tuple(200.0 + n for n in range(1, 7)), (1.5, -2.0, 179.0)
    )


@pytest.mark.parametrize("value", [None, "5.0", True, 1e9, [1.0], float("nan")])
def test_esp32_pressures_that_are_none_make_no_feedback_and_lengths_only_gaps(
    value: object,
) -> None:
    """A pressure is needed to control; a potentiometer may be missing."""
    assert esp32.protocol.parse(json.dumps(FEEDBACK | {"pressure_2": value}).encode()) is None
    said = esp32.protocol.parse(json.dumps(FEEDBACK | {"potentiometer_2": value}).encode())
    assert isinstance(said, Feedback)
    assert [math.isnan(length) for length in said.potentiometers_mm].index(True) == 1


def test_esp32_other_lines_are_remarks() -> None:
    parse = esp32.protocol.parse
    assert parse(b'{"status":"ESP32 ready"}') == Remark("ESP32 ready", False)
    assert parse(b'{"error":"Invalid JSON command"}') == Remark("Invalid JSON command", True)
    unknown = parse(b'{"status":"error","message":"Unknown command: x"}')
    assert unknown == Remark("Unknown command: x", True)
    assert parse(b"[1, 2]") is None
    assert parse(b'{"pressure_1":1.0') is None


def test_esp32_vents_with_zeros_and_never_by_closing_the_valves() -> None:
    assert json.loads(esp32.protocol.VENT) == {"command": "set_pressure", "values": [0.0, 0.0, 0.0]}
    assert json.loads(esp32.protocol.set_pressures([1234.0, 0.0, 13e3]))["values"] == [
        1.23,
        0.0,
        13.0,
    ]


def test_channels_there_and_back() -> None:
    """Every chamber's value on its own channel, zeros on the others."""
    arm = trunk_arm()
    numbers = tuple(random.Random(1).sample(range(12), arm.n_chambers))
    channels = Channels(arm, 12, numbers, "valves")
    values = np.arange(1.0, 10.0).reshape(3, 3)
    spread = channels.scatter(values)
    assert np.array_equal(channels.gather(spread), values)
    assert sum(spread) == values.sum()


@pytest.mark.parametrize(
    ("count", "numbers", "words"),
    [
        (8, (0, 1, 1), "a channel of its own"),
        (8, (0, 1, 8), "0 to 7"),
        (8, (0, 1, -1), "0 to 7"),
        (8, (0, 1), "3 channels are needed"),
        (2, (0, 1), "has 2 channels"),
    ],
)
def test_channels_that_do_not_fit_are_refused(
    count: int, numbers: tuple[int, ...], words: str
) -> None:
    with pytest.raises(ConfigurationError, match=words):
        Channels(paper_arm(), count, numbers, "[ctrl_p] valves")


@settings(max_examples=300)
@given(
    st.floats(-1e5, 0.0),
    st.floats(1.0, 1e6),
    st.floats(0.1, 900.0),
    st.lists(st.floats(-2e6, 2e6), min_size=3, max_size=3),
)
def test_whole_steps_never_leave_the_limits(
    low: float, high: float, step: float, asked: list[float]
) -> None:
    """However the limits lie between the steps; and no further off than one step."""
    section = replace(TABLE1_SECTION, pressure_min_pa=low, pressure_max_pa=high)
    sent = StepCommand(Arm("any", (section,)), step, "it").sendable_pa(np.array([asked]))
    assert (sent >= low).all()
    assert (sent <= high).all()
    nearest = np.clip(asked, low, high)
    assert (np.abs(sent - nearest) <= step * (1.0 + 1e-9)).all()
