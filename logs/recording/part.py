"""One part of a session: an MCAP file that survives a full disk and a sudden death."""

import fcntl
import os
from pathlib import Path

from mcap.records import Channel, Schema
from mcap.well_known import MessageEncoding
from mcap_protobuf.schema import build_file_descriptor_set

from pneuarm.logs.reading.parts import PART, SESSION
from pneuarm.logs.recording.chunked_file import ChunkedFile
from pneuarm.logs.schema.topics import Topic, full_key

#: Compress in pieces of this size, so that no single piece stalls the recorder for long.
_CHUNK_BYTES = 256 * 1024


class PatientFile:
    """An output that keeps what the disk does not take, and offers it again at the next drain."""

    def __init__(self, path: Path) -> None:
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        fcntl.flock(self._fd, fcntl.LOCK_EX)
        self._pending = bytearray()
        self._size = 0

    def write(self, data: bytes) -> int:
        """Take data; nothing is written before :meth:`drain`."""
        self._pending += data
        self._size += len(data)
        return len(data)

    def tell(self) -> int:
        """Size of the file once everything is written."""
        return self._size

    @property
    def pending_bytes(self) -> int:
        """What the disk has not taken yet."""
        return len(self._pending)

    def drain(self) -> None:
        """Write everything pending; raises OSError, and keeps the rest, if the disk refuses."""
        while self._pending:
            written = os.write(self._fd, self._pending)
            del self._pending[:written]

    def close(self) -> None:
        """Close and release the lock; what is still pending is lost. Safe to call twice."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1


def schema_of(topic: Topic, number: int) -> Schema:
    """Describe the messages of a topic; raises ValueError where anything may be sent."""
    if topic.message is None:
        raise ValueError(f"{topic.key} has no message type and cannot be logged")
    return Schema(
        id=number,
        name=topic.message.DESCRIPTOR.full_name,
        encoding=MessageEncoding.Protobuf,
        data=build_file_descriptor_set(topic.message).SerializeToString(),
    )


class Part:
    """Writes messages of our topics to one MCAP file; every channel says whose part it is."""

    def __init__(self, path: Path, arm_name: str, session: str = "", number: int = 0) -> None:
        self.path = path
        #: Whether chunks are compressed: what a recorder that lags gives up first.
        self.compress = True
        self._arm_name = arm_name
        self._identity = {SESSION: session or path.stem, PART: str(number)}
        self._file = PatientFile(path)
        self._mcap = ChunkedFile(self._file)
        self._channels: dict[str, int] = {}
        #: Whether its end is written, on the disk or not yet: nothing can come behind it.
        self.finished = False

    def write(self, topic: Topic, payload: bytes, time_unix_ns: int, sequence: int = 0) -> None:
        """Add one serialised message."""
        channel = self._channels.get(topic.key)
        if channel is None:
            channel = self._register(topic)
        self._mcap.add_message(channel, time_unix_ns, payload, sequence)
        if self._mcap.open_bytes > _CHUNK_BYTES:
            self._mcap.end_chunk(self.compress)

    def _register(self, topic: Topic) -> int:
        number = len(self._channels) + 1
        channel = Channel(
            id=number,
            topic=full_key(self._arm_name, topic.key),
            message_encoding=MessageEncoding.Protobuf,
            metadata=self._identity,
            schema_id=number,
        )
        self._mcap.register(schema_of(topic, number), channel)
        self._channels[topic.key] = number
        return number

    def add_metadata(self, name: str, data: dict[str, str]) -> None:
        """Add a metadata record."""
        self._mcap.add_metadata(name, data)

    @property
    def size_bytes(self) -> int:
        """Size of the file, without the chunk in progress."""
        return self._file.tell()

    @property
    def pending_bytes(self) -> int:
        """What waits in memory for the disk."""
        return self._file.pending_bytes

    def flush(self) -> None:
        """Close the chunk in progress and put everything on the disk; raises OSError."""
        self._mcap.end_chunk(self.compress)
        self._file.drain()

    def finish(self) -> None:
        """Write index and footer and close; raises OSError, and may be tried again."""
        if not self.finished:
            self._mcap.finish()
            self.finished = True
        self._file.drain()
        self._file.close()
