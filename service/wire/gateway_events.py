"""What the gateway writes down: accepted messages, and why others were refused."""

import threading
import time
from collections import Counter

from google.protobuf.message import Message

from pneuarm.logs.rings.rings import MessageWriter
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.printable import printable
from pneuarm.logs.schema.topics import EVENT, Topic
from pneuarm.service.processes.shared import Shared
from pneuarm.service.processes.telling import Telling
from pneuarm.service.wire.lease import Lease
from pneuarm.service.wire.publisher import Publisher

_SHOWN_PAYLOAD_BYTES = 200


class Notes:
    """Writes to the gateway's ring; ``lock`` is held for every write and every use of the lease."""

    def __init__(
        self, shared: Shared, publisher: Publisher, lease: Lease, lock: threading.RLock
    ) -> None:
        self.lock = lock
        self.rejected = 0
        self._shared, self._publisher, self._lease = shared, publisher, lease
        self._messages = MessageWriter(shared.rings.gateway)
        # What strangers make of refusals does not hide those of the lease's holder.
        self._holders, self._strangers = Telling(self._write), Telling(self._write)
        self._skipped: Counter[str] = Counter()  # a key is counted by its own thread only
        self._skips_told: Counter[str] = Counter()
        self._skips_told_ns = 0

    def log(self, topic: Topic, message: Message, monotonic_ns: int) -> None:
        """Write down a message that was accepted, or one of our own."""
        with self.lock:
            self._messages.write(topic, message, self._shared.unix_ns(monotonic_ns))

    def reject(
        self,
        key: str,
        reason: str,
        client: str = "",
        payload: bytes = b"",
        target_sequence: int = 0,
        *,
        holder: bool = False,
    ) -> None:
        """Tell why a message changed nothing; ``holder``: it proved to be the lease's holder's."""
        event = self._warning("rejected", f"{key}: {reason}", client)
        event.key, event.target_sequence = key, target_sequence
        with self.lock:
            self.rejected += 1
            event.payload = self._lease.redacted(payload)[:_SHOWN_PAYLOAD_BYTES]
            (self._holders if holder else self._strangers).tell(event)

    def skip(self, key: str) -> None:
        """Count a message that was not even read, without a lock; :meth:`step` tells of them."""
        self._skipped[key] += 1

    @property
    def refused(self) -> int:
        """Messages that changed nothing, read or not."""
        return self.rejected + self._skipped.total()

    def tell(self, code: str, text: str, client: str) -> None:
        """Write down a warning about what the lease's holder, or a source, does."""
        with self.lock:
            self._holders.tell(self._warning(code, text, client))

    def _warning(self, code: str, text: str, client: str) -> pb.Event:
        return pb.Event(
            time_unix_ns=self._shared.unix_ns(time.monotonic_ns()),
            level=pb.WARNING,
            source="gateway",
            code=code,
            text=printable(text),
            client_id=printable(client, 64),
            mode=self._publisher.newest_mode,
        )

    def step(self) -> None:
        """Tell what was counted and is due."""
        now_ns = self._shared.unix_ns(time.monotonic_ns())
        with self.lock:
            if now_ns - self._skips_told_ns >= 1_000_000_000:
                self._skips_told_ns = now_ns
                self._tell_skips()
            self._holders.step(now_ns)
            self._strangers.step(now_ns)

    def _tell_skips(self) -> None:
        skipped = Counter(self._skipped)
        for key, number in (skipped - self._skips_told).items():
            event = self._warning(
                "rejected",
                f"{key}: {number} messages were not read: those before them cost more computing "
                "time than they may; send fewer, or smaller ones",
                "",
            )
            event.key = key
            self._strangers.tell(event)
        self._skips_told = skipped

    def _write(self, event: pb.Event) -> None:
        self._messages.write(EVENT, event, event.time_unix_ns)
