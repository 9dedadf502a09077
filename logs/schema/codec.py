"""Bytes <-> messages: protobuf, or protobuf's own JSON mapping, checked on the way in."""

from typing import TypeVar

from google.protobuf import json_format
from google.protobuf.message import DecodeError, Message
from google.protobuf.unknown_fields import UnknownFieldSet

from pneuarm.controllers.arm.errors import MessageRejected
from pneuarm.logs.schema.printable import printable

#: No message of ours comes near this size.
MAX_PAYLOAD_BYTES = 65536

JSON = "application/json"
PROTOBUF = "application/protobuf"

M = TypeVar("M", bound=Message)


def encoding_of(message: Message) -> str:
    """Zenoh encoding of a protobuf payload, the message's full name as its schema."""
    return f"{PROTOBUF};{message.DESCRIPTOR.full_name}"


def is_json(encoding: str) -> bool:
    """Say whether an encoding is JSON; anything else is read as protobuf."""
    return encoding.split(";")[0] in (JSON, "text/json")


def decode(
    message_type: type[M],
    payload: bytes,
    encoding: str,
    *,
    tolerant: bool = False,
    most_bytes: int = MAX_PAYLOAD_BYTES,
) -> M:
    """Read a message; raises MessageRejected with one sentence for anything that is not one.

    What the daemon takes may hold nothing that it does not know. What it gives is read
    ``tolerant``, so that a newer daemon may say more than an older client knows.
    """
    name = message_type.DESCRIPTOR.full_name
    if len(payload) > most_bytes and not tolerant:
        raise MessageRejected(f"payload of {len(payload)} bytes; at most {most_bytes} are read")
    schema = encoding.partition(";")[2]
    if schema and schema != name:
        raise MessageRejected(f"message of type {schema[:100]!r}; this key takes {name}")
    message = message_type()
    try:
        if is_json(encoding):
            json_format.Parse(payload.decode("utf-8"), message, ignore_unknown_fields=tolerant)
        else:
            message.ParseFromString(payload)
    except (json_format.Error, DecodeError, ValueError, RecursionError) as error:
        kind = "JSON" if is_json(encoding) else "protobuf"
        detail = printable((str(error).splitlines() or [""])[0], 200)
        raise MessageRejected(f"payload is not the {kind} form of {name}: {detail}") from error
    if not tolerant and _has_unknown_fields(message):
        raise MessageRejected(
            f"payload has fields that {name} does not have; a message of another type, or of a "
            "newer client than this daemon?"
        )
    return message


def _has_unknown_fields(message: Message) -> bool:
    """Look into every message inside too, also where there are many of them."""
    if len(UnknownFieldSet(message)) > 0:
        return True
    for field, value in message.ListFields():
        if field.message_type is None or field.message_type.GetOptions().map_entry:
            continue
        if any(_has_unknown_fields(inner) for inner in (value if field.is_repeated else [value])):
            return True
    return False


def encode(message: Message, encoding: str) -> bytes:
    """Write a message as protobuf, or as JSON if the encoding says so."""
    if is_json(encoding):
        text = json_format.MessageToJson(message, preserving_proto_field_name=True, indent=None)
        return text.encode("utf-8")
    return message.SerializeToString()
