"""The generated classes are those of the .proto."""

import re
from pathlib import Path

from pneuarm.logs.schema import pneuarm_pb2 as pb

_PROTO = (Path(__file__).parents[3] / "logs/schema/pneuarm.proto").read_text()
_BLOCK = re.compile(r"^message (\w+) \{(\}|.*?^\})", re.MULTILINE | re.DOTALL)
_FIELD = re.compile(r"(\w+) = (\d+)(?: \[.*\])?;")


def test_every_message_has_the_fields_of_its_definition() -> None:
    written = {name: set(_FIELD.findall(_fields(body))) for name, body in _BLOCK.findall(_PROTO)}
    generated = {
        name: {(field.name, str(field.number)) for field in message.fields}
        for name, message in pb.DESCRIPTOR.message_types_by_name.items()
    }
    assert written == generated, "run `make proto`"


def test_every_enumeration_has_the_values_of_its_definition() -> None:
    block = re.compile(_BLOCK.pattern.replace("message", "enum"), _BLOCK.flags)
    written = {name: set(_FIELD.findall(_fields(body))) for name, body in block.findall(_PROTO)}
    generated = {
        name: {(value.name, str(value.number)) for value in enum.values}
        for name, enum in pb.DESCRIPTOR.enum_types_by_name.items()
    }
    assert written == generated, "run `make proto`"


def _fields(body: str) -> str:
    return re.sub(r"//.*", "", body)
