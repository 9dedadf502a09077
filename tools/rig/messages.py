"""Messages with any values at all in any fields, for hypothesis."""

from typing import Any

from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import Message
from hypothesis import strategies as st

_INTEGERS = {
    FieldDescriptor.CPPTYPE_INT32: (-(2**31), 2**31 - 1),
    FieldDescriptor.CPPTYPE_UINT32: (0, 2**32 - 1),
    FieldDescriptor.CPPTYPE_INT64: (-(2**63), 2**63 - 1),
    FieldDescriptor.CPPTYPE_UINT64: (0, 2**64 - 1),
    FieldDescriptor.CPPTYPE_ENUM: (-(2**31), 2**31 - 1),
}

#: What breaks arithmetic: the ends of the range, and what lies just beside zero and one.
_EDGES = (0.0, -0.0, 5e-324, 1e-308, 1e-9, 1.0, 1e9, 1e308, -1e308, float("inf"), float("nan"))


def _values(field: Any, depth: int) -> st.SearchStrategy[Any]:
    if field.message_type is not None:
        return messages(field.message_type._concrete_class, depth - 1)
    if field.cpp_type in _INTEGERS:
        low, high = _INTEGERS[field.cpp_type]
        near = st.integers(max(low, -2), 12)
        return near | st.integers(low, high)
    if field.cpp_type in (FieldDescriptor.CPPTYPE_DOUBLE, FieldDescriptor.CPPTYPE_FLOAT):
        return st.sampled_from(_EDGES) | st.floats(-0.3, 0.3) | st.floats()
    if field.cpp_type == FieldDescriptor.CPPTYPE_BOOL:
        return st.booleans()
    if field.type == FieldDescriptor.TYPE_BYTES:
        return st.binary(max_size=20)
    return st.sampled_from(["base", "tip", "world", ""]) | st.text(max_size=20)


@st.composite
def messages(draw: st.DrawFn, message_type: type[Message], depth: int = 6) -> Message:
    """Draw a message with some of its fields set; nested ones down to ``depth``."""
    message = message_type()
    fields = [f for f in message.DESCRIPTOR.fields if depth > 0 or f.message_type is None]
    for field in draw(st.lists(st.sampled_from(fields), unique_by=id)) if fields else ():
        if field.is_repeated:
            values = draw(st.lists(_values(field, depth), max_size=4))
            if field.message_type is None:
                getattr(message, field.name).extend(values)
            else:
                for value in values:
                    getattr(message, field.name).add().CopyFrom(value)
        elif field.message_type is not None:
            getattr(message, field.name).CopyFrom(draw(_values(field, depth)))
        else:
            setattr(message, field.name, draw(_values(field, depth)))
    return message
