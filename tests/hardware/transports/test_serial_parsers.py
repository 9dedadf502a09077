"""No line surprises the parser of a serial device, whatever comes."""

import math
import random

from hypothesis import example, given, settings
from hypothesis import strategies as st

from pneuarm.hardware import ctrl_p, esp32
from pneuarm.hardware.ctrl_p.protocol import Echo, Telemetry
from pneuarm.hardware.esp32.protocol import Feedback, Remark

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
