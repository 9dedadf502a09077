"""Tables of messages, enums and keys, from the comments of the .proto and the table of topics."""

import re
from functools import cache
from pathlib import Path

from google.protobuf.descriptor import Descriptor, FieldDescriptor

from pneuarm.logs.rings.tick import tick_dtype
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import TOPICS, Topic
from pneuarm.service.modes.mode import ModeEvent
from pneuarm.service.safety.faults import FAULTS
from tools.docs.regions import NoSuchTable, linked, table

PROTO = Path(__file__).resolve().parents[2] / "logs" / "schema" / "pneuarm.proto"

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

_DIRECTIONS = {
    "in": "put, to the daemon",
    "out": "published",
    "query": "query",
    "file": "in the log only",
}

_BLOCK = re.compile(r"(?:message|enum) (\w+)")
_MEMBER = re.compile(r"(\w+) = \d+")


@cache
def comments() -> dict[str, str]:
    """Return the comments of the .proto by `Message`, `Message.field` and `Enum.VALUE`.

    One stands before its line or behind it; the generated classes have none.
    """
    found: dict[str, str] = {}
    block, before = "", []
    for line in PROTO.read_text().splitlines():
        code, _, behind = line.partition("//")
        if behind and not code.strip():
            before.append(behind.strip())
            continue
        if begins := _BLOCK.match(code):
            block = begins[1]
            found[block] = " ".join([*before, behind.strip()]).strip()
        elif member := _MEMBER.search(code):
            found[f"{block}.{member[1]}"] = " ".join([*before, behind.strip()]).strip()
        before = []
    return found


def messages() -> dict[str, Descriptor]:
    """All messages of the .proto by their names."""
    return dict(pb.DESCRIPTOR.message_types_by_name)


def make_message(name: str) -> str:
    """Return what is said of a message, and the table of its fields."""
    message = messages().get(name.removeprefix("message").strip())
    if message is None:
        raise NoSuchTable(f"{PROTO.name} has no {name}")
    rows = [
        [f"`{field.name}`", _type(field), _meaning(message.name, field)] for field in message.fields
    ]
    heading = ("field", "type, unit", "meaning")
    parts = [linked(comments()[message.name]), table(heading, rows) if rows else ""]
    return "\n\n".join(part for part in parts if part)


def _meaning(message: str, field: FieldDescriptor) -> str:
    told = linked(comments()[f"{message}.{field.name}"])
    choice = field.containing_oneof
    if choice is None or field is not choice.fields[0]:
        return told
    return "; ".join(part for part in (f"exactly one of these {len(choice.fields)}", told) if part)


def _type(field: FieldDescriptor) -> str:
    message = field.message_type
    if message is not None and message.GetOptions().map_entry:
        return f"map to {_plain(message.fields_by_name['value'])}"
    unit = next((unit for end, unit in UNITS.items() if field.name.endswith(f"_{end}")), "")
    is_word = field.type in (FieldDescriptor.TYPE_STRING, FieldDescriptor.TYPE_BYTES)
    return _many(field) + (f", {unit}" if unit and not is_word else "")


def _many(field: FieldDescriptor) -> str:
    """Return the type, and of an array how many there are: a vector's, or one a chamber."""
    if not field.is_repeated:
        return _plain(field)
    in_tick = field.containing_type is pb.ArmState.DESCRIPTOR
    shape = tick_dtype(1)[field.name].shape if in_tick else ()
    return f"{shape[0]} {_plain(field)}" if len(shape) == 1 else f"{_plain(field)} each"


#: Names of the types as the .proto has them.
_TYPES = {
    value: name.removeprefix("TYPE_").lower()
    for name, value in vars(FieldDescriptor).items()
    if name.startswith("TYPE_")
}


def _plain(field: FieldDescriptor) -> str:
    """Return a field's type; messages are links to what is said of them."""
    if field.message_type is not None:
        return f"[`{field.message_type.name}`](#{field.message_type.name.lower()})"
    if field.enum_type is not None:
        return f"`{field.enum_type.name}`"
    return _TYPES[field.type]


def make_enums(name: str) -> str:
    """Return all enums, each value with its number and its comment."""
    rows = []
    for enum in pb.DESCRIPTOR.enum_types_by_name.values():
        values = []
        for value in enum.values:
            told = comments()[f"{enum.name}.{value.name}"]
            values.append(f"{value.number} `{value.name}`" + (f" ({told})" if told else ""))
        rows.append([f"`{enum.name}`", ", ".join(values), comments()[enum.name]])
    return table(("enum", "values", "meaning"), rows)


def make_topics(name: str) -> str:
    """Return the keys: what is said under each, in which direction, how often."""
    rows = [[_key(topic), *_topic(topic)] for topic in TOPICS]
    return table(("key", "direction", "message", "rate"), rows)


def _key(topic: Topic) -> str:
    return f"`{topic.key}`" + (f", `{topic.key}{topic.suffix}`" if topic.suffix else "")


def _topic(topic: Topic) -> list[str]:
    asked = topic.newest or (topic.direction == "in" and topic.reply is not None)
    direction = _DIRECTIONS[topic.direction] + ("; also answers queries" if asked else "")
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
    faults = ", ".join(f"`{code}`" for code in FAULTS)
    return f"Codes of the modes: {modes}.\n\nCodes of the faults: {faults}."
