"""A tick's record to the bytes of its ArmState, without a message in between.

The arrays of a record are, byte for byte, what protobuf writes of a packed field, so they are
copied. The result is what `state_from_tick(tick).SerializeToString()` gives, in a fraction of the
time.
"""

import struct
from math import isnan
from operator import itemgetter
from typing import Any

from google.protobuf.descriptor import FieldDescriptor

from pneuarm.logs.rings.tick import tick_dtype
from pneuarm.logs.schema.pneuarm_pb2 import ArmState

#: Kinds of values on protobuf's wire.
_VARINT, _FIXED64, _BYTES = 0, 1, 2
_WHOLE_NUMBERS = {
    FieldDescriptor.TYPE_UINT64,
    FieldDescriptor.TYPE_UINT32,
    FieldDescriptor.TYPE_ENUM,
}
_ZERO = bytes(8)
_NAN = struct.pack("<d", float("nan"))


def varint(value: int) -> bytes:
    """Return a whole number that is not negative as protobuf writes it."""
    written = bytearray()
    while value > 0x7F:
        written.append(value & 0x7F | 0x80)
        value >>= 7
    written.append(value)
    return bytes(written)


_SMALL = [varint(value) for value in range(128)]


class StatePacker:
    """Packs the records of one arm's ticks."""

    def __init__(self, n_sections: int) -> None:
        dtype = tick_dtype(n_sections)
        places = dict(dtype.fields or {})
        fields: list[Any] = list(ArmState.DESCRIPTOR.fields)  # as they stand in the record
        sizes = [places[field.name][0].itemsize for field in fields]
        codes = map(_code, fields, sizes)
        self._unpack = struct.Struct("<" + "".join(codes)).unpack
        order = sorted(range(len(fields)), key=lambda index: fields[index].number)
        self._in_order = itemgetter(*order)
        #: Of each field, in the order of their numbers: its kind, what goes before its value, and
        #: the value that is left out.
        self._fields = [_wire_form(fields[index], sizes[index]) for index in order]
        self._time = places["time_unix_ns"][1]

    def pack(self, record: bytes) -> bytes:
        """Return the serialised ArmState of a tick; what is zero or not known is left out."""
        written: list[bytes] = []
        values = self._in_order(self._unpack(record))
        for (kind, tag, left_out), value in zip(self._fields, values, strict=True):
            if value == left_out:
                continue
            if kind == _VARINT:
                written += (tag, _SMALL[value] if value < 128 else varint(value))
            elif kind == _FIXED64 or value[7] & 0x7F != 0x7F or not _is_unknown(value):
                written += (tag, value)  # an array's first number is nearly always finite
        return b"".join(written)

    def time_unix_ns(self, record: bytes) -> int:
        """Return the time of a tick."""
        return int.from_bytes(record[self._time : self._time + 8], "little", signed=True)


def _code(field: Any, size: int) -> str:
    """Return how :mod:`struct` unpacks a field: whole numbers as such, all else as bytes."""
    if field.type in _WHOLE_NUMBERS:
        return "I" if size == 4 else "Q"
    return f"{size}s"


def _wire_form(field: Any, size: int) -> tuple[int, bytes, object]:
    if field.is_repeated:
        return _BYTES, varint(field.number << 3 | _BYTES) + varint(size), _NAN * (size // 8)
    if field.type in _WHOLE_NUMBERS:
        return _VARINT, varint(field.number << 3 | _VARINT), 0
    return _FIXED64, varint(field.number << 3 | _FIXED64), _ZERO


def _is_unknown(raw: bytes) -> bool:
    """Say whether every number of an array is NaN, of whatever bits."""
    return all(map(isnan, struct.unpack(f"<{len(raw) // 8}d", raw)))
