"""Bytes <-> messages: whatever arrives is a message, or refused in one sentence."""

import json

import pytest
from google.protobuf import json_format
from google.protobuf.message import Message
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.arm.errors import MessageRejected
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.codec import JSON, MAX_PAYLOAD_BYTES, PROTOBUF, decode, encode, encoding_of
from pneuarm.logs.schema.topics import TOPICS, Topic

WITH_MESSAGE = [topic for topic in TOPICS if topic.message is not None]
ENCODINGS = [PROTOBUF, JSON, "", "text/json", "zenoh/bytes", "text/plain"]

TARGET = pb.Target(
    client_id="me",
    sequence=2**63,
    law=pb.QP_IK,
    pose=pb.PoseTarget(
        frame_id="base", position_m=pb.Vector3(x=0.1, z=-2e-9), orientation=pb.Quaternion(w=1.0)
    ),
)


def refusal(payload: bytes, encoding: str, message_type: type[Message] = pb.Target) -> str:
    with pytest.raises(MessageRejected) as caught:
        decode(message_type, payload, encoding)
    text = str(caught.value)
    assert "\n" not in text
    assert len(text) < 400
    return text


def filled(message_type: type[Message]) -> Message:
    """A message with every field set, in every element too; of a oneof the last."""
    message = message_type()
    for number, field in enumerate(message.DESCRIPTOR.fields, 1):
        if field.message_type is not None and field.message_type.GetOptions().map_entry:
            text = field.message_type.fields_by_name["value"].cpp_type == field.CPPTYPE_STRING
            getattr(message, field.name)["a"] = "b" if text else 1.5
            continue
        if field.message_type is not None:
            inner = filled(field.message_type._concrete_class)
            if field.is_repeated:
                getattr(message, field.name).extend([inner, inner])
            else:
                getattr(message, field.name).CopyFrom(inner)
            continue
        if field.cpp_type == field.CPPTYPE_STRING:
            value: object = b"\x00\xff" if field.type == field.TYPE_BYTES else "text é"
        elif field.cpp_type == field.CPPTYPE_ENUM:
            value = field.enum_type.values[-1].number
        elif field.cpp_type == field.CPPTYPE_BOOL:
            value = True
        else:
            value = number
        if field.is_repeated:
            getattr(message, field.name).extend([value] * 3)
        else:
            setattr(message, field.name, value)
    return message


def others_of_oneofs(message: Message) -> int:
    return sum(len(oneof.fields) - 1 for oneof in message.DESCRIPTOR.oneofs)


def read(payload: bytes, encoding: str, message_type: type[Message] = pb.Target) -> Message | str:
    """The message, or why there is none; any other exception fails the test."""
    try:
        return decode(message_type, payload, encoding)
    except MessageRejected as error:
        return str(error)


@pytest.mark.parametrize("topic", WITH_MESSAGE, ids=lambda topic: topic.key)
@pytest.mark.parametrize("encoding", [PROTOBUF, JSON])
def test_every_message_of_the_table_goes_there_and_back(topic: Topic, encoding: str) -> None:
    assert topic.message is not None
    message = filled(topic.message)
    assert len(message.ListFields()) == len(message.DESCRIPTOR.fields) - others_of_oneofs(message)
    assert decode(topic.message, encode(message, encoding), encoding) == message
    empty = topic.message()
    assert decode(topic.message, encode(empty, encoding), encoding) == empty


def test_json_has_the_names_of_the_schema() -> None:
    text = json.loads(encode(TARGET, JSON))
    assert text["pose"]["position_m"] == {"x": 0.1, "z": -2e-9}
    assert (text["law"], text["sequence"]) == ("QP_IK", str(2**63))


@pytest.mark.parametrize("topic", WITH_MESSAGE, ids=lambda topic: topic.key)
def test_the_encoding_names_the_message(topic: Topic) -> None:
    assert topic.message is not None
    message = filled(topic.message)
    encoding = encoding_of(message)
    assert encoding == f"application/protobuf;{message.DESCRIPTOR.full_name}"
    assert decode(topic.message, message.SerializeToString(), encoding) == message


@given(payload=st.binary(max_size=300), encoding=st.sampled_from(ENCODINGS))
def test_rubbish_is_a_message_or_refused(payload: bytes, encoding: str) -> None:
    for topic in WITH_MESSAGE:
        assert topic.message is not None
        found = read(payload, encoding, topic.message)
        assert isinstance(found, topic.message) or "\n" not in found


JSON_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from([field.name for field in pb.Target.DESCRIPTOR.fields])
            | st.sampled_from(["frame_id", "position_m", "x", "linear_m_s", "length_m"])
            | st.text(max_size=4),
            inner,
            max_size=3,
        )
    ),
    max_leaves=8,
)


@given(JSON_VALUES)
def test_any_json_is_a_target_or_refused(value: object) -> None:
    found = read(json.dumps(value).encode(), JSON)
    assert isinstance(found, pb.Target) or "JSON form of pneuarm.Target" in found


@pytest.mark.parametrize(
    "text",
    ["{", "1", "null", "true", '"x"', "NaN", '{"law": Infinity}', '{"law": {}}', '{"a":' * 5000],
)
def test_json_that_is_none_or_no_target_is_refused(text: str) -> None:
    assert "payload is not the JSON form of pneuarm.Target" in refusal(text.encode(), JSON)


def test_half_a_surrogate_pair_is_refused_in_a_sentence_that_can_be_written() -> None:
    refused = refusal(rb'{"lengths": {"length_m": "\ud800"}}', JSON)
    assert "\\ud800" in refused
    refused.encode()


def test_text_that_is_not_utf_8_is_refused() -> None:
    assert "JSON" in refusal(b'{"client_id": "\xff"}', JSON)


@pytest.mark.parametrize("size", range(1, TARGET.ByteSize()))
def test_a_truncated_message_is_refused_or_a_shorter_one(size: int) -> None:
    # Protobuf has no end mark: between two fields a shorter message is a message.
    payload = TARGET.SerializeToString()[:size]
    found = read(payload, PROTOBUF)
    if isinstance(found, pb.Target):
        assert found.SerializeToString() == payload
        assert not found.HasField("pose")
    else:
        assert isinstance(found, str)
        assert "payload is not the protobuf form of pneuarm.Target" in found


def test_a_message_of_another_type_is_refused_by_the_name_of_its_schema() -> None:
    text = refusal(b"", "application/protobuf;pneuarm.Reply")
    assert text == "message of type 'pneuarm.Reply'; this key takes pneuarm.Target"


def test_a_message_with_fields_that_are_none_of_ours_is_refused() -> None:
    stranger = filled(pb.Health).SerializeToString()
    assert "does not have; wrong message type?" in refusal(stranger, PROTOBUF, pb.ModeRequest)
    inner = b"\x52\x05\x62\x03abc"  # position: {field 12: "abc"}
    assert "does not have; wrong message type?" in refusal(inner, PROTOBUF)
    assert "no field named" in refusal(b'{"position": {"position_mm": {}}}', JSON)


@pytest.mark.parametrize("encoding", [PROTOBUF, JSON])
@pytest.mark.parametrize("size", [MAX_PAYLOAD_BYTES + 1, 10_000_000])
def test_a_huge_payload_is_refused_unread(
    encoding: str, size: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(json_format, "Parse", None)
    text = refusal(b" " * size, encoding)
    assert text == f"payload of {size} bytes; at most 65536 are read"


def test_the_largest_payload_is_read() -> None:
    assert decode(pb.Target, b"{" + b" " * (MAX_PAYLOAD_BYTES - 2) + b"}", JSON) == pb.Target()
