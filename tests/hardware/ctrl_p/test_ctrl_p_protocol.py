"""The protocol of a Ctrl-P, bytes against values."""

import pytest

from pneuarm.hardware import ctrl_p
from pneuarm.hardware.ctrl_p.protocol import Echo, Kind, Mode, Telemetry


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
