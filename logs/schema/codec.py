"""Bytes <-> messages: protobuf, or protobuf's own JSON mapping, checked on the way in."""

from typing import TypeVar

from google.protobuf import json_format
from google.protobuf.message import DecodeError, Message
from google.protobuf.unknown_fields import UnknownFieldSet

from pneuarm.controllers.arm.errors import MessageRejected

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


def decode(message_type: type[M], payload: bytes, encoding: str) -> M:
    """Read a message; raises MessageRejected with one sentence for anything that is not one."""
    name = message_type.DESCRIPTOR.full_name
    if len(payload) > MAX_PAYLOAD_BYTES:
        raise MessageRejected(
            f"payload of {len(payload)} bytes; at most {MAX_PAYLOAD_BYTES} are read"
        )
    schema = encoding.partition(";")[2]
    if schema and schema != name:
        raise MessageRejected(f"message of type {schema!r}; this key takes {name}")
    message = message_type()
    try:
        if is_json(encoding):
            json_format.Parse(payload.decode("utf-8"), message)
        else:
            message.ParseFromString(payload)
    except (json_format.ParseError, DecodeError, UnicodeDecodeError, RecursionError) as error:
        kind = "JSON" if is_json(encoding) else "protobuf"
        # Half a surrogate pair in JSON cannot be written as UTF-8, so not into an event.
        shown = str(error).encode("utf-8", "backslashreplace").decode()
        detail = shown.splitlines()[0][:200]
        raise MessageRejected(f"payload is not the {kind} form of {name}: {detail}") from error
    if _has_unknown_fields(message):
        raise MessageRejected(f"payload has fields that {name} does not have; wrong message type?")
    return message


def _has_unknown_fields(message: Message) -> bool:
    if len(UnknownFieldSet(message)) > 0:
        return True
    return any(
        _has_unknown_fields(value)
        for _, value in message.ListFields()
        if isinstance(value, Message)  # not the list of a repeated field
    )


def encode(message: Message, encoding: str) -> bytes:
    """Write a message as protobuf, or as JSON if the encoding says so."""
    if is_json(encoding):
        text = json_format.MessageToJson(message, preserving_proto_field_name=True, indent=None)
        return text.encode("utf-8")
    return message.SerializeToString()
