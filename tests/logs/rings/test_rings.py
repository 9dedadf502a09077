"""Messages in rings: order, topic and time; an event always fits."""

import pytest
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.logs.rings.ring import RingMemory, RingReader, RingWriter
from pneuarm.logs.rings.rings import HOLD_S, MessageReader, MessageWriter, Rings
from pneuarm.logs.rings.tick import tick_dtype
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import ESTOP, EVENT, TARGET, TIP_POSE, Topic
from tools.rig.recording import CONTEXT


def memory(capacity: int = 64) -> RingMemory:
    return RingMemory.create(CONTEXT, capacity, 1008)


def event(text: str) -> pb.Event:
    return pb.Event(text=text)


def texts(found: list[tuple[Topic, bytes, int]]) -> list[str]:
    return [pb.Event.FromString(payload).text for _, payload, _ in found]


@pytest.mark.parametrize(("n_sections", "rate_hz"), [(1, 1000.0), (3, 500.0), (16, 50.0)])
def test_the_tick_ring_holds_more_than_thirty_seconds(n_sections: int, rate_hz: float) -> None:
    rings = Rings.create(CONTEXT, n_sections, rate_hz)
    assert HOLD_S >= 30.0
    # A lapped reader goes on an eighth of the ring behind its end.
    assert rings.ticks.capacity > HOLD_S * rate_hz
    assert rings.ticks.payload_bytes >= tick_dtype(n_sections).itemsize
    assert len({id(ring) for ring in (rings.ticks, *rings.messages())}) == 4


def test_messages_come_back_with_topic_and_time() -> None:
    ring = memory()
    writer = MessageWriter(ring)
    written = [
        (EVENT, event("a"), 5),
        (TARGET, pb.Target(sequence=3), 6),
        (TIP_POSE, PoseInFrame(frame_id="base"), -1),
    ]
    for topic, message, time_ns in written:
        writer.write(topic, message, time_ns)
    reader = MessageReader((ring,))
    found = [
        (topic, type(message).FromString(payload), time)
        for (topic, payload, time), (_, message, _) in zip(reader.read(), written, strict=True)
    ]
    assert found == written
    assert reader.read() == []


def test_every_ring_is_read_in_its_order() -> None:
    rings = (memory(), memory())
    writers = [MessageWriter(ring) for ring in rings]
    for number in range(6):
        writers[number % 2].write(EVENT, event(f"{number}"), number)
    assert texts(MessageReader(rings).read()) == ["0", "2", "4", "1", "3", "5"]


def test_a_reader_may_go_on_where_another_was() -> None:
    rings = (memory(), memory())
    writers = [MessageWriter(ring) for ring in rings]
    first = MessageReader(rings)
    for number in range(4):
        writers[number % 2].write(EVENT, event(f"{number}"), number)
    first.read()
    writers[1].write(EVENT, event("new"), 9)
    assert first.next_sequences() == [3, 3]
    assert texts(MessageReader(rings, first.next_sequences()).read()) == ["new"]


def test_what_was_overwritten_is_counted_over_all_rings() -> None:
    rings = (memory(8), memory(8))
    writers = [MessageWriter(ring) for ring in rings]
    for number in range(20):
        writers[number % 2].write(EVENT, event(f"{number}"), number)
    reader = MessageReader(rings)
    assert len(reader.read()) + reader.missed == 20
    assert reader.missed > 0


def test_what_is_not_logged_has_no_place_in_a_ring() -> None:
    with pytest.raises(ValueError, match="not in"):
        MessageWriter(memory()).write(ESTOP, event(""), 0)


def long_target(n_waypoints: int = 200) -> pb.Target:
    waypoints = [
        pb.Waypoint(time_s=0.1 * n, position_m=pb.Vector3(x=0.01 * n, y=0.1, z=0.2))
        for n in range(n_waypoints)
    ]
    return pb.Target(sequence=7, trajectory=pb.TrajectoryTarget(waypoints=waypoints))


def test_a_message_longer_than_a_record_comes_back_whole_and_in_order() -> None:
    ring = memory()
    writer, reader = MessageWriter(ring), MessageReader((ring,))
    target = long_target()
    assert target.ByteSize() > 5000
    for number in range(20):  # several times around the ring
        writer.write(EVENT, event("before"), number)
        writer.write(TARGET, target, number)
        found = reader.read()
        assert [topic for topic, _, _ in found] == [EVENT, TARGET]
        assert pb.Target.FromString(found[1][1]) == target
        assert found[1][2] == number
    assert (reader.missed, reader.next_sequences()) == (0, [RingReader(ring).head() + 1])


def records_of(message: pb.Target) -> list[bytes]:
    ring = memory()
    MessageWriter(ring).write(TARGET, message, 1)
    return [record for _, record in RingReader(ring).read(64)]


def test_a_successor_begins_with_the_message_that_its_predecessor_had_not_whole() -> None:
    ring, target = memory(), long_target()
    first = MessageReader((ring,))
    MessageWriter(ring).write(EVENT, event("a"), 0)
    writer = RingWriter(ring)
    records = records_of(target)
    for record in records[:3]:
        writer.write(record)
    assert texts(first.read()) == ["a"]
    assert first.next_sequences() == [2]
    for record in records[3:]:
        writer.write(record)
    for reader in (first, MessageReader((ring,), first.next_sequences())):
        ((topic, payload, _),) = reader.read()
        assert (topic, pb.Target.FromString(payload)) == (TARGET, target)
        assert reader.missed == 0


@pytest.mark.parametrize("cut", [1, 3])
def test_what_a_dead_writer_left_incomplete_is_dropped_and_counted(cut: int) -> None:
    ring, records = memory(), records_of(long_target())
    writer = RingWriter(ring)
    for record in records[:cut]:
        writer.write(record)
    MessageWriter(ring).write(EVENT, event("successor"), 1)
    reader = MessageReader((ring,))
    assert texts(reader.read()) == ["successor"]
    assert reader.missed == cut


def test_a_reader_that_is_lapped_within_a_message_goes_on_with_the_next_whole_one() -> None:
    ring, records = memory(8), records_of(long_target(60))
    assert 2 < len(records) < 8
    writer = RingWriter(ring)
    for number in range(30):
        writer.write(records[number % len(records)])
    MessageWriter(ring).write(EVENT, event("last"), 1)
    reader = MessageReader((ring,))
    found = reader.read()
    assert found[-1][0] == EVENT
    assert all(pb.Target.FromString(p) == long_target(60) for t, p, _ in found if t == TARGET)
    whole = sum(len(records) if topic == TARGET else 1 for topic, _, _ in found)
    assert reader.missed + whole == 31


def test_a_message_that_is_too_long_is_refused() -> None:
    ring = memory()
    with pytest.raises(ValueError, match="at most"):
        MessageWriter(ring).write(TARGET, pb.Target(client_id="x" * 300_000), 0)
    assert RingReader(ring).head() == 0


@given(
    st.lists(st.text(), min_size=4, max_size=4), st.binary(max_size=300), st.sampled_from([1, 400])
)
def test_an_event_always_arrives_its_texts_cut_where_they_must_be(
    words: list[str], payload: bytes, times: int
) -> None:
    text, cause, remedy, client = (word * times for word in words)
    long = pb.Event(
        time_unix_ns=2**62, level=pb.ERROR, source="control", code="fault", mode=pb.FAULT
    )
    long.text, long.cause, long.remedy, long.client_id = text, cause, remedy, client
    long.payload = payload
    ring = memory()
    MessageWriter(ring).write(EVENT, long, 1)
    ((_, found, _),) = MessageReader((ring,)).read()
    short = pb.Event.FromString(found)
    if long.ByteSize() <= 990:
        assert short == long
    assert (short.level, short.code, short.mode) == (long.level, long.code, long.mode)
    assert text.startswith(short.text)
    assert len(short.text.encode()) >= min(240, len(text.encode()))
    assert (cause.startswith(short.cause), remedy.startswith(short.remedy)) == (True, True)
    assert long.text == text  # the caller's own is as it was


def test_cutting_does_not_break_a_character() -> None:
    ring = memory()
    MessageWriter(ring).write(EVENT, event("é" * 1000), 1)
    (text,) = texts(MessageReader((ring,)).read())
    assert set(text) == {"é"}
