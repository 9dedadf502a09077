"""What the gateway writes down: accepted messages, and why others were refused."""

import threading
import time

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
        self._unread: dict[str, int] = {}
        self._unread_told_ns = 0

    def log(self, topic: Topic, message: Message, monotonic_ns: int) -> None:
        """Write down a message that was accepted, or one of our own."""
        with self.lock:
            self._messages.write(topic, message, self._shared.unix_ns(monotonic_ns))

    def reject(
        self, key: str, reason: str, payload: bytes, client: str, *, holder: bool = False
    ) -> None:
        """Tell why a message changed nothing; ``holder``: it proved to be the lease's holder's."""
        with self.lock:
            self.rejected += 1
            shown = self._lease.redacted(payload)[:_SHOWN_PAYLOAD_BYTES]
            self.tell("rejected", f"{key}: {reason}", client, shown, holder=holder)

    def skip(self, key: str) -> None:
        """Count a message that was not even read; :meth:`step` tells of them."""
        with self.lock:
            self.rejected += 1
            self._unread[key] = self._unread.get(key, 0) + 1

    def tell(
        self, code: str, text: str, client: str, payload: bytes = b"", *, holder: bool = False
    ) -> None:
        """Write down a warning, for everybody to read; what repeats is counted."""
        event = pb.Event(
            time_unix_ns=self._shared.unix_ns(time.monotonic_ns()),
            level=pb.WARNING,
            source="gateway",
            code=code,
            text=printable(text),
            client_id=printable(client, 64),
            mode=self._publisher.newest_mode,
            payload=payload,
        )
        with self.lock:
            (self._holders if holder else self._strangers).tell(event)

    def step(self) -> None:
        """Tell what was counted and is due."""
        now_ns = self._shared.unix_ns(time.monotonic_ns())
        with self.lock:
            if self._unread and now_ns - self._unread_told_ns >= 1_000_000_000:
                self._unread_told_ns = now_ns
                self._tell_unread()
            self._holders.step(now_ns)
            self._strangers.step(now_ns)

    def _tell_unread(self) -> None:
        for key, number in self._unread.items():
            self.tell(
                "rejected",
                f"{key}: {number} messages were not read: those before them cost more computing "
                "time than they may; send fewer, or smaller ones",
                "",
            )
        self._unread.clear()

    def _write(self, event: pb.Event) -> None:
        self._messages.write(EVENT, event, event.time_unix_ns)
