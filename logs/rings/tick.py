"""The record of one tick: an ArmState as a fixed-size numpy record, and both ways between them.

`schema/pneuarm.proto` is the only definition. A repeated field of ArmState becomes an array of as
many elements as its option `elements` says, without that option of one a chamber. An unknown array
is NaN in the record and empty in the message.
"""

import struct
from collections.abc import Callable, Mapping
from functools import cache
from math import isnan
from operator import itemgetter
from typing import Any

import numpy as np
from google.protobuf.descriptor import FieldDescriptor

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.pneuarm_pb2 import ArmState

#: Place of an array among the fields, its name, and its bytes where it is not known.
_ArrayField = tuple[int, str, bytes]

_TYPES = {
    FieldDescriptor.TYPE_UINT64: "<u8",
    FieldDescriptor.TYPE_SFIXED64: "<i8",
    FieldDescriptor.TYPE_UINT32: "<u4",
    FieldDescriptor.TYPE_ENUM: "<u4",
    FieldDescriptor.TYPE_DOUBLE: "<f8",
}


def _shape(field: Any, n_sections: int) -> tuple[int, ...]:
    if not field.is_repeated:
        return ()
    elements = field.GetOptions().Extensions[pb.elements]
    return (elements,) if elements else (n_sections, 3)


@cache
def tick_dtype(n_sections: int) -> np.dtype[np.void]:
    """Record type of a tick of an arm with ``n_sections`` sections."""
    fields = [
        (field.name, _TYPES[field.type], _shape(field, n_sections))
        for field in ArmState.DESCRIPTOR.fields
    ]
    return np.dtype(fields)


def new_tick(n_sections: int) -> np.ndarray:
    """One tick, shape (), with every array unknown."""
    tick = np.zeros((), dtype=tick_dtype(n_sections))
    for name in _ARRAYS:
        tick[name] = np.nan
    tick["n_sections"] = n_sections
    return tick


def pack_tick(n_sections: int, values: Mapping[str, Any]) -> bytes:
    """Bytes of the record with these values, one for every field of the message.

    An array is one of float64, or a list of floats; one that is None is not known. Raises KeyError
    for a field without a value, ValueError for an array of another size than its field's.
    """
    packing, in_order, arrays = _packing(n_sections)
    packed = list(in_order(values))
    for index, name, unknown in arrays:
        value = packed[index]
        if value is None:
            packed[index] = unknown
        else:
            raw = (value if isinstance(value, np.ndarray) else np.array(value)).tobytes()
            if len(raw) != len(unknown):
                raise ValueError(f"{name} has {len(raw)} bytes; in ArmState it has {len(unknown)}")
            packed[index] = raw
    return packing.pack(*packed)


@cache
def _packing(
    n_sections: int,
) -> tuple[struct.Struct, Callable[[Mapping[str, Any]], tuple[Any, ...]], list[_ArrayField]]:
    """What packs one argument a field, what puts values in that order, and which are arrays."""
    blank = new_tick(n_sections)
    names = tick_dtype(n_sections).names or ()
    codes = [f"{blank[name].nbytes}s" if name in _ARRAYS else _CODES[name] for name in names]
    arrays = [
        (index, name, blank[name].tobytes()) for index, name in enumerate(names) if name in _ARRAYS
    ]
    return struct.Struct("<" + "".join(codes)), itemgetter(*names), arrays


_ARRAYS = tuple(field.name for field in ArmState.DESCRIPTOR.fields if field.is_repeated)
_SCALARS = tuple(field.name for field in ArmState.DESCRIPTOR.fields if not field.is_repeated)
#: How :mod:`struct` packs a scalar.
_CODES = {
    field.name: {"<u8": "Q", "<i8": "q", "<u4": "I", "<f8": "d"}[_TYPES[field.type]]
    for field in ArmState.DESCRIPTOR.fields
}


def state_from_tick(tick: np.void | np.ndarray) -> ArmState:
    """Message of a tick."""
    state = ArmState(**{name: tick[name].item() for name in _SCALARS})
    for name in _ARRAYS:
        values = tick[name].reshape(-1).tolist()
        if not all(map(isnan, values)):  # a part may be unknown: a chamber without a sensor
            getattr(state, name).extend(values)
    return state


@cache
def _sizes(n_sections: int) -> tuple[tuple[str, int], ...]:
    blank = new_tick(n_sections)
    return tuple((name, blank[name].size) for name in _ARRAYS)


def fits(state: ArmState, n_sections: int) -> bool:
    """Whether every array of a state is that of an arm with so many sections, or not known."""
    return all(len(getattr(state, name)) in (0, size) for name, size in _sizes(n_sections))


def ticks_from_states(states: list[ArmState], n_sections: int) -> np.ndarray:
    """Ticks, shape (len(states),), of messages of one arm."""
    ticks = np.zeros(len(states), dtype=tick_dtype(n_sections))
    for name in _SCALARS:
        ticks[name] = [getattr(state, name) for state in states]
    for name in _ARRAYS:
        shape = ticks.dtype[name].shape
        unknown = [np.nan] * int(np.prod(shape))
        rows = [list(getattr(state, name)) or unknown for state in states]
        ticks[name] = np.array(rows, dtype=np.float64).reshape(len(states), *shape)
    return ticks
