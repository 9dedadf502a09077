"""The ring: order, laps counted exactly, torn records withheld, and two real processes."""

import multiprocessing
import struct
import time
import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.logs.rings.ring import RingMemory, RingReader, RingWriter

CONTEXT = multiprocessing.get_context("spawn")
CAPACITY = 16
#: How far behind the newest record a lapped reader goes on, of CAPACITY.
REJOINED = 14


def ring(capacity: int = CAPACITY, payload_bytes: int = 48) -> RingMemory:
    return RingMemory.create(CONTEXT, capacity, payload_bytes)


def payload(number: int) -> bytes:
    return f"record {number}".encode() * (1 + number % 4)


def write(writer: RingWriter, count: int) -> None:
    for _ in range(count):
        writer.write(payload(writer.last_sequence + 1))


def expected(numbers: range) -> list[tuple[int, bytes]]:
    return [(number, payload(number)) for number in numbers]


def test_an_empty_ring_has_nothing_to_read() -> None:
    reader = RingReader(ring())
    assert reader.head() == 0
    assert reader.read(10) == []
    assert reader.missed == 0


def test_records_come_in_order_with_numbers_from_one_and_only_once() -> None:
    memory = ring()
    writer, reader = RingWriter(memory), RingReader(memory)
    assert [writer.write(payload(number)) for number in (1, 2, 3)] == [1, 2, 3]
    assert reader.read(2) == expected(range(1, 3))
    assert reader.read(2) == expected(range(3, 4))
    assert reader.read(2) == []
    assert reader.head() == writer.last_sequence == 3


def test_the_ring_wraps_around_without_losing_a_record_that_is_read_in_time() -> None:
    memory = ring()
    writer, reader = RingWriter(memory), RingReader(memory)
    records = []
    for _ in range(20):
        write(writer, 7)
        records += reader.read(100)
    assert records == expected(range(1, 141))
    assert reader.missed == 0


def test_a_reader_keeps_all_that_the_ring_holds() -> None:
    memory = ring()
    write(RingWriter(memory), CAPACITY)
    reader = RingReader(memory)
    assert reader.read(100) == expected(range(1, CAPACITY + 1))
    assert reader.missed == 0


@pytest.mark.parametrize("written", [CAPACITY + 1, CAPACITY + 5, 10 * CAPACITY + 3])
def test_a_lapped_reader_knows_exactly_how_many_it_missed(written: int) -> None:
    memory = ring()
    write(RingWriter(memory), written)
    reader = RingReader(memory)
    records = reader.read(1000)
    assert records == expected(range(written - REJOINED, written + 1))
    assert reader.missed == written - REJOINED - 1


@given(st.lists(st.tuples(st.integers(0, 40), st.integers(0, 40)), max_size=30))
def test_what_is_read_and_what_is_missed_is_all_that_was_written(
    turns: list[tuple[int, int]],
) -> None:
    memory = ring()
    writer, reader = RingWriter(memory), RingReader(memory)
    records = []
    for written, at_most in turns:
        write(writer, written)
        new = reader.read(at_most)
        assert len(new) <= at_most
        records += new
    records += reader.read(1000)
    assert records == [(number, payload(number)) for number, _ in records]
    numbers = [number for number, _ in records]
    assert numbers == sorted(set(numbers))
    assert len(records) + reader.missed == writer.last_sequence


def test_readers_do_not_disturb_each_other() -> None:
    memory = ring()
    writer, slow, fast = RingWriter(memory), RingReader(memory), RingReader(memory)
    write(writer, 10)
    fast.read(100)
    write(writer, 10)
    assert fast.read(100) == expected(range(11, 21))
    assert (fast.missed, slow.read(1), slow.missed) == (0, expected(range(6, 7)), 5)


def test_skipping_is_not_missing() -> None:
    memory = ring()
    write(RingWriter(memory), 9)
    reader = RingReader(memory)
    assert reader.skip_to(7) == 6
    assert reader.read(100) == expected(range(7, 10))
    assert reader.skip_to(3) == 0
    assert reader.missed == 0


def test_a_reader_may_begin_later() -> None:
    memory = ring()
    write(RingWriter(memory), 9)
    assert RingReader(memory, next_sequence=8).read(100) == expected(range(8, 10))


@pytest.mark.parametrize("byte", range(8 + 4 + 4 + len(payload(3))))
def test_a_record_with_any_byte_wrong_is_not_returned(byte: int) -> None:
    memory = ring()
    write(RingWriter(memory), 5)
    view = memory.view()
    view[memory.offset(3) + byte] ^= 0x10
    reader = RingReader(memory)
    assert reader.record(3) is None
    assert reader.read(100) == expected(range(1, 3))  # and waits there
    view[memory.offset(3) + byte] ^= 0x10
    assert reader.read(100) == expected(range(3, 6))
    assert reader.missed == 0


def test_a_record_of_another_lap_is_not_taken_for_the_one_wanted() -> None:
    memory = ring()
    write(RingWriter(memory), CAPACITY + 3)
    reader = RingReader(memory)
    assert reader.record(3) is None
    assert reader.record(CAPACITY + 3) == payload(CAPACITY + 3)
    assert reader.record(2 * CAPACITY + 3) is None


def test_the_number_is_part_of_the_checksum() -> None:
    memory = ring()
    write(RingWriter(memory), 1)
    header = struct.pack("<QII", 1, len(payload(1)), zlib.crc32(payload(1)))
    memory.view()[memory.offset(1) : memory.offset(1) + len(header)] = header
    assert RingReader(memory).record(1) is None


def test_a_writer_that_died_within_a_record_leaves_nothing_to_read_of_it() -> None:
    memory = ring()
    write(RingWriter(memory), 2)
    start = memory.offset(3)
    memory.view()[start + 16 : start + 20] = b"half"
    reader = RingReader(memory)
    assert reader.read(100) == expected(range(1, 3))
    write(RingWriter(memory), 1)
    assert reader.read(100) == expected(range(3, 4))


def test_a_writer_that_follows_another_goes_on_counting() -> None:
    memory = ring()
    write(RingWriter(memory), 300)  # beyond one byte of the counter
    reader = RingReader(memory, next_sequence=298)
    follower = RingWriter(memory)
    assert follower.last_sequence == 300
    write(follower, 4)
    assert reader.read(100) == expected(range(298, 305))


def test_a_payload_that_is_too_long_is_refused_and_changes_nothing() -> None:
    memory = ring()
    writer, reader = RingWriter(memory), RingReader(memory)
    longest = bytes(range(memory.payload_bytes))
    with pytest.raises(ValueError, match=f"at most {memory.payload_bytes}"):
        writer.write(longest + b"!")
    assert reader.head() == 0
    assert writer.write(longest) == 1
    assert reader.read(10) == [(1, longest)]


@pytest.mark.parametrize("payload_bytes", [1, 47, 48, 49, 1000])
def test_the_ring_holds_records_as_long_as_was_asked_for(payload_bytes: int) -> None:
    memory = ring(3, payload_bytes)
    writer, reader = RingWriter(memory), RingReader(memory)
    records = [bytes([number]) * payload_bytes for number in range(1, 4)]
    for record in records:
        writer.write(memoryview(record))
    assert [read for _, read in reader.read(10)] == records


def test_an_empty_payload_is_a_record() -> None:
    memory = ring()
    RingWriter(memory).write(b"")
    assert RingReader(memory).read(10) == [(1, b"")]


BURST = 20_000


def write_in_child(memory: RingMemory, count: int) -> None:
    write(RingWriter(memory), count)


@pytest.mark.timeout(50)
@pytest.mark.parametrize("capacity", [8, 2 * BURST], ids=["lapped", "roomy"])
def test_a_writer_in_another_process_is_read_whole_or_counted_as_missed(capacity: int) -> None:
    memory = ring(capacity)
    reader = RingReader(memory)
    records = []
    for restart in (1, 2):  # the second writer follows the first
        child = CONTEXT.Process(target=write_in_child, args=(memory, BURST))
        child.start()
        while child.is_alive() or reader.next_sequence <= reader.head():
            records += reader.read(64)
            time.sleep(0.0)
        child.join()
        assert child.exitcode == 0
        assert reader.head() == restart * BURST
    assert all(payload(number) == content for number, content in records)
    numbers = [number for number, _ in records]
    assert numbers == sorted(set(numbers))
    assert len(records) + reader.missed == 2 * BURST
    if capacity > BURST:
        assert reader.missed == 0
