"""A record packed straight into bytes is, byte for byte, the message of the tick."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.logs.rings.state_packer import StatePacker, varint
from pneuarm.logs.rings.tick import new_tick, state_from_tick
from pneuarm.logs.schema.pneuarm_pb2 import ArmState

#: What doubles have of peculiar; -0.0 is not the 0.0 that protobuf leaves out.
DOUBLES = st.floats() | st.sampled_from([0.0, -0.0, math.nan, math.inf, -math.inf, 5e-324])


def some_tick(draw: st.DataObject, n_sections: int) -> np.ndarray:
    tick = new_tick(n_sections)
    for name in tick.dtype.names or ():
        field = tick.dtype[name]
        if field.shape:
            if draw.draw(st.booleans(), name):
                size = math.prod(field.shape)
                values = draw.draw(st.lists(DOUBLES, min_size=size, max_size=size), name)
                tick[name] = np.array(values).reshape(field.shape)
        elif field.kind == "f":
            tick[name] = draw.draw(DOUBLES, name)
        elif ArmState.DESCRIPTOR.fields_by_name[name].enum_type is not None:
            tick[name] = draw.draw(st.integers(0, 12), name)
        else:
            limits = np.iinfo(field)
            tick[name] = draw.draw(st.integers(max(limits.min, 0), limits.max), name)
    return tick


@pytest.mark.parametrize("n_sections", [1, 3])
@given(draw=st.data())
def test_the_bytes_are_those_of_the_message(n_sections: int, draw: st.DataObject) -> None:
    tick = some_tick(draw, n_sections)
    packer = StatePacker(n_sections)
    assert packer.pack(tick.tobytes()) == state_from_tick(tick).SerializeToString()
    assert packer.time_unix_ns(tick.tobytes()) == tick["time_unix_ns"]


@given(st.integers(0, 2**64 - 1))
def test_a_varint_is_protobufs(value: int) -> None:
    written = ArmState(sequence=value).SerializeToString()
    assert written == (b"\x08" + varint(value) if value else b"")
