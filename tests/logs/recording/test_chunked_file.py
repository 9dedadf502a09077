"""A file that is recorded for days takes no memory for what stands in it already."""

import tracemalloc
from random import Random

from mcap.records import Channel

from pneuarm.logs.recording.chunked_file import ChunkedFile
from pneuarm.logs.recording.part import schema_of
from pneuarm.logs.schema.topics import EVENT, STATE, TF, TIP

TOPICS = (STATE, EVENT, TF, TIP)


class _Nowhere:
    """An output that keeps nothing."""

    size = 0

    def write(self, data: bytes) -> int:
        self.size += len(data)
        return len(data)

    def tell(self) -> int:
        return self.size


def test_a_chunk_that_is_written_leaves_hardly_anything_in_memory() -> None:
    file, random, time_ns = ChunkedFile(_Nowhere()), Random(0), 1_700_000_000_000_000_000
    for number, topic in enumerate(TOPICS, 1):
        channel = Channel(number, topic.key, "protobuf", {}, number)
        file.register(schema_of(topic, number), channel)

    def held_after(chunks: int) -> int:
        nonlocal time_ns
        for _ in range(chunks):
            for channel in range(1, len(TOPICS) + 1):
                time_ns += random.randrange(50_000_000)
                file.add_message(channel, time_ns, random.randbytes(random.randrange(500)), 0)
            file.end_chunk(compress=False)
        return tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    try:
        before = held_after(500)
        held = (held_after(4000) - before) / 4000
    finally:
        tracemalloc.stop()
    # Four or five of them are written in a second: a megabyte in an hour.
    assert held < 70
    file.finish()
