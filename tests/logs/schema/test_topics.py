"""The one table of keys is the wire as it is designed."""

import pytest

from pneuarm.logs.schema.topics import LOGGED, TOPICS, Topic, full_key, split_key

POSE, FRAMES = "foxglove.PoseInFrame", "foxglove.FrameTransforms"

#: Key, direction, message, rate on the wire (Hz), whether it is in the file, and its rate there.
WIRE = {
    ("cmd/target", "in", "pneuarm.Target", None, True, None),
    ("cmd/estop", "in", None, None, False, None),
    ("cmd/mode", "query", "pneuarm.ModeRequest", None, False, None),
    ("sensor/tip_pose", "in", POSE, None, True, None),
    ("state", "out", "pneuarm.ArmState", 100.0, True, None),
    ("tip", "out", POSE, 100.0, True, 100.0),
    ("tf", "out", FRAMES, 100.0, True, 100.0),
    ("health", "out", "pneuarm.Health", 1.0, True, None),
    ("event", "out", "pneuarm.Event", None, True, None),
    ("info", "query", "pneuarm.Info", None, True, None),
    ("events", "query", "pneuarm.Events", None, False, None),
}


def row(topic: Topic) -> tuple[str, str, str | None, float | None, bool, float | None]:
    name = None if topic.message is None else topic.message.DESCRIPTOR.full_name
    rates = topic.rate_hz, topic.logged_rate_hz
    return topic.key, topic.direction, name, rates[0], topic.logged, rates[1]


def test_the_table_is_the_wire_table() -> None:
    assert {row(topic) for topic in TOPICS if topic.direction != "file"} == WIRE


def test_what_is_only_in_the_file_is_never_said_on_the_wire() -> None:
    for topic in TOPICS:
        if topic.direction == "file":
            assert topic.logged
            assert topic.rate_hz is None


def test_every_key_stands_there_once() -> None:
    keys = [topic.key for topic in TOPICS]
    assert len(keys) == len(set(keys)) == len(TOPICS)


def test_everything_that_is_logged_has_a_message() -> None:
    assert {topic.key for topic in LOGGED} == {topic.key for topic in TOPICS if topic.logged}
    assert all(topic.message is not None for topic in LOGGED)


def test_arrays_and_numbers_of_our_messages_carry_their_unit() -> None:
    units = ("_m", "_pa", "_s", "_ns", "_rad", "_hz", "_us", "_m_s", "_rad_s", "_xyzw", "_bytes")
    no_unit = {"cpu_share", "simulator"}  # a share, and names that carry units of their own
    for topic in TOPICS:
        if topic.message is None or not topic.message.DESCRIPTOR.full_name.startswith("pneuarm"):
            continue
        for field in topic.message.DESCRIPTOR.fields:
            if field.cpp_type == field.CPPTYPE_DOUBLE and field.name not in no_unit:
                assert field.name.endswith(units), f"{topic.key}: {field.name}"


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.key)
def test_a_key_is_found_again_in_its_full_form(topic: Topic) -> None:
    assert full_key("my-arm", topic.key) == f"pneuarm/my-arm/{topic.key}"
    assert split_key(full_key("my-arm", topic.key)) == ("my-arm", topic.key)


@pytest.mark.parametrize("topic", ["", "state", "/pneuarm/a/state", "robot/a/state", "pneuarm/a"])
def test_keys_of_others_are_not_ours(topic: str) -> None:
    assert split_key(topic) == ("", "")
