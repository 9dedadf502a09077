"""What the gateway writes down: accepted messages, and why others were refused."""

import threading
import time

from google.protobuf.message import Message

from pneuarm.logs.rings.rings import MessageWriter
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import EVENT, Topic
from pneuarm.service.processes.shared import Shared
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

    def log(self, topic: Topic, message: Message, monotonic_ns: int) -> None:
        """Write down a message that was accepted, or one of our own."""
        with self.lock:
            self._messages.write(topic, message, self._shared.unix_ns(monotonic_ns))

    def reject(
        self, key: str, reason: str, client: str, payload: bytes = b"", target_sequence: int = 0
    ) -> None:
        """Tell why a message changed nothing."""
        event = self._warning("rejected", f"{key}: {reason}", client)
        event.key, event.target_sequence = key, target_sequence
        event.payload = self._lease.redacted(payload)[:_SHOWN_PAYLOAD_BYTES]
        with self.lock:
            self.rejected += 1
            self._messages.write(EVENT, event, event.time_unix_ns)

    def tell(self, code: str, text: str, client: str) -> None:
        """Write down a warning, for everybody to read."""
        event = self._warning(code, text, client)
        with self.lock:
            self._messages.write(EVENT, event, event.time_unix_ns)

    def _warning(self, code: str, text: str, client: str) -> pb.Event:
        return pb.Event(
            time_unix_ns=self._shared.unix_ns(time.monotonic_ns()),
            level=pb.WARNING,
            source="gateway",
            code=code,
            text=text[:400],
            client_id=client[:64],
            mode=self._publisher.newest_mode,
        )
