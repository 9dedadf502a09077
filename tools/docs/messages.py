"""Tables of messages, enums and keys, from the comments of the .proto and the table of topics."""

import tempfile
from functools import cache
from importlib.resources import files
from pathlib import Path

from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.descriptor_pb2 import (
    DescriptorProto,
    FieldDescriptorProto,
    FileDescriptorProto,
    FileDescriptorSet,
)
from grpc_tools import protoc

from pneuarm.logs.rings.tick import tick_dtype
from pneuarm.logs.schema.topics import TOPICS, Topic
from pneuarm.service.modes.mode import ModeEvent
from pneuarm.service.safety.faults import FaultCode
from tools.docs.regions import NoSuchTable, linked, table

ROOT = Path(__file__).resolve().parents[2]
PROTO = "pneuarm/logs/schema/pneuarm.proto"

#: Where protoc finds the messages of its own, as its command line does by itself.
_GOOGLE = files("grpc_tools").joinpath("_proto")

#: Unit of a field by the end of its name, the longest first.
UNITS = {
    "rad_s": "rad/s",
    "m_s": "m/s",
    "ns": "ns",
    "us": "us",
    "hz": "Hz",
    "pa": "Pa gauge",
    "rad": "rad",
    "bytes": "bytes",
    "m": "m",
    "s": "s",
}

#: Where in a file its messages, their fields, its enums and their values stand: descriptor.proto.
_MESSAGES, _FIELDS, _ENUMS, _VALUES = 4, 2, 5, 2

_DIRECTIONS = {
    "in": "put, to the daemon",
    "out": "published",
    "query": "query",
    "file": "in the log only",
}


@cache
def _file() -> FileDescriptorProto:
    """Read the .proto with its comments; the generated classes have none."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "set"
        arguments = ["protoc", f"-I{ROOT}", f"-I{_GOOGLE}", f"--descriptor_set_out={path}"]
        if protoc.main([*arguments, "--include_source_info", PROTO]):
            raise RuntimeError(f"protoc does not read {PROTO}: see above")
        return FileDescriptorSet.FromString(path.read_bytes()).file[0]


@cache
def _comments() -> dict[tuple[int, ...], str]:
    """Return every comment by the path of what it stands at: before it, or behind it."""
    return {
        tuple(place.path): " ".join(f"{place.leading_comments} {place.trailing_comments}".split())
        for place in _file().source_code_info.location
    }


def messages() -> dict[str, DescriptorProto]:
    """All messages of the .proto by their names."""
    return {message.name: message for message in _file().message_type}


def make_message(name: str) -> str:
    """Return what is said of a message, and the table of its fields."""
    wanted = name.removeprefix("message").strip()
    if wanted not in messages():
        raise NoSuchTable(f"{PROTO} has no message {wanted!r}")
    number = list(messages()).index(wanted)
    told = _comments().get((_MESSAGES, number), "")
    rows = [
        [f"`{field.name}`", _type(wanted, field), _meaning(messages()[wanted], index)]
        for index, field in enumerate(messages()[wanted].field)
    ]
    parts = [linked(told), table(("field", "type, unit", "meaning"), rows) if rows else ""]
    return "\n\n".join(part for part in parts if part)


def comment_of(message: str, index: int) -> str:
    """Return the comment of a field."""
    place = (_MESSAGES, list(messages()).index(message), _FIELDS, index)
    return linked(_comments().get(place, ""))


def _meaning(message: DescriptorProto, index: int) -> str:
    field = message.field[index]
    told = comment_of(message.name, index)
    if not field.HasField("oneof_index"):
        return told
    together = [other for other in message.field if other.HasField("oneof_index")]
    if field is not together[0]:
        return told
    return "; ".join(part for part in (f"exactly one of these {len(together)}", told) if part)


def _type(message: str, field: FieldDescriptorProto) -> str:
    entry = _map_value(field)
    if entry is not None:
        return f"map to {_plain(entry)}"
    unit = next((unit for end, unit in UNITS.items() if field.name.endswith(f"_{end}")), "")
    is_word = field.type in (FieldDescriptor.TYPE_STRING, FieldDescriptor.TYPE_BYTES)
    return _many(message, field) + (f", {unit}" if unit and not is_word else "")


def _many(message: str, field: FieldDescriptorProto) -> str:
    """Return the type, and of an array how many there are: a vector's, or one a chamber."""
    if field.label != FieldDescriptor.LABEL_REPEATED:
        return _plain(field)
    shape = tick_dtype(1)[field.name].shape if message == "ArmState" else ()
    return f"{shape[0]} {_plain(field)}" if len(shape) == 1 else f"{_plain(field)} each"


def _map_value(field: FieldDescriptorProto) -> FieldDescriptorProto | None:
    """Return the values' field where a field is a map."""
    for message in _file().message_type:
        for nested in message.nested_type:
            if nested.options.map_entry and field.type_name.endswith(f".{nested.name}"):
                return nested.field[1]
    return None


def _plain(field: FieldDescriptorProto) -> str:
    """Return a field's type; messages are links to what is said of them."""
    name = field.type_name.rpartition(".")[2]
    if field.type == FieldDescriptor.TYPE_MESSAGE:
        return f"[`{name}`](#{name.lower()})"
    if field.type == FieldDescriptor.TYPE_ENUM:
        return f"`{name}`"
    return FieldDescriptorProto.Type.Name(field.type).removeprefix("TYPE_").lower()


def make_enums(name: str) -> str:
    """Return all enums, each value with its number and its comment."""
    rows = []
    for number, enum in enumerate(_file().enum_type):
        values = []
        for index, value in enumerate(enum.value):
            told = _comments().get((_ENUMS, number, _VALUES, index), "")
            values.append(f"{value.number} `{value.name}`" + (f" ({told})" if told else ""))
        rows.append([f"`{enum.name}`", ", ".join(values), _comments().get((_ENUMS, number), "")])
    return table(("enum", "values", "meaning"), rows)


def make_topics(name: str) -> str:
    """Return the keys: what is said under each, in which direction, how often."""
    rows = [[f"`{topic.key}`", *_topic(topic)] for topic in TOPICS]
    return table(("key", "direction", "message", "rate"), rows)


def _topic(topic: Topic) -> list[str]:
    direction = _DIRECTIONS[topic.direction] + ("; also answers queries" if topic.newest else "")
    message = "anything, also nothing" if topic.message is None else _message(topic.message)
    if topic.reply is not None:
        message = f"{message}, answered by {_message(topic.reply)}"
    if topic.direction == "query" and topic.reply is None:
        message = f"no payload needed, answered by {message}"
    rate = "" if topic.rate_hz is None else f"{topic.rate_hz:g} Hz"
    logged = f"{topic.logged_rate_hz:g} Hz in the log" if topic.logged_rate_hz else ""
    if logged and topic.rate_hz == topic.logged_rate_hz:
        logged = ""
    return [direction, message, "; ".join(part for part in (rate, topic.when, logged) if part)]


def _message(message: type) -> str:
    name: str = message.DESCRIPTOR.full_name.removeprefix("pneuarm.")  # type: ignore[attr-defined]
    return f"[`{name}`](#{name.lower().replace('.', '')})"


def make_codes(name: str) -> str:
    """Return the codes of events that come from the tables of modes and faults."""
    modes = ", ".join(f"`{event.name.lower()}`" for event in ModeEvent)
    faults = ", ".join(f"`{code.name.lower()}`" for code in FaultCode)
    return f"Codes of the modes: {modes}.\n\nCodes of the faults: {faults}."
