"""The protocol of an ESP32 controller, bytes against values."""

import json
import math

import pytest

from pneuarm.hardware import esp32
from pneuarm.hardware.esp32.protocol import Feedback, Remark

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
