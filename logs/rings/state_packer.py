"""A tick's record to the bytes of its ArmState, without a message in between.

The arrays of a record are, byte for byte, what protobuf writes of a packed field, so they are
copied. The result is what `state_from_tick(tick).SerializeToString()` gives, in a fraction of the
time.
"""

import struct
from math import isnan
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


class StatePacker:
    """Packs the records of one arm's ticks."""

    def __init__(self, n_sections: int) -> None:
        dtype = tick_dtype(n_sections)
        places = dict(dtype.fields or {})
        #: Of each field, in the order of their numbers: kind, what goes before it, where it is.
        self._fields: list[tuple[int, bytes, slice]] = []
        fields: list[Any] = sorted(ArmState.DESCRIPTOR.fields, key=lambda field: field.number)
        for field in fields:
            begin, size = places[field.name][1], places[field.name][0].itemsize
            kind = _VARINT if field.type in _WHOLE_NUMBERS else _FIXED64
            tag = varint(field.number << 3 | (_BYTES if field.is_repeated else kind))
            if field.is_repeated:
                kind, tag = _BYTES, tag + varint(size)
            self._fields.append((kind, tag, slice(begin, begin + size)))
        self._time = places["time_unix_ns"][1]

    def pack(self, record: bytes) -> bytes:
        """Return the serialised ArmState of a tick; what is zero or not known is left out."""
        written = []
        for kind, tag, place in self._fields:
            raw = record[place]
            if kind == _BYTES:
                if not _is_unknown(raw):
                    written.append(tag + raw)
            elif kind == _FIXED64:
                if raw != _ZERO:
                    written.append(tag + raw)
            elif value := int.from_bytes(raw, "little"):
                written.append(tag + varint(value))
        return b"".join(written)

    def time_unix_ns(self, record: bytes) -> int:
        """Return the time of a tick."""
        return int.from_bytes(record[self._time : self._time + 8], "little", signed=True)


def _is_unknown(raw: bytes) -> bool:
    """Say whether every number of an array is NaN."""
    if raw[7] & 0x7F != 0x7F:  # the first number is finite: nearly always
        return False
    n = len(raw) // 8
    return raw == _NAN * n or all(map(isnan, struct.unpack(f"<{n}d", raw)))
