"""Who may measure the tip: the publisher that the configuration names, else the first there is.

A publisher is told by its key, ``sensor/tip_pose/<source>``, which Zenoh's access control can give
to one certificate alone; where a key file is configured, each pose also carries as its attachment
the HMAC-SHA256 (RFC 2104) of its payload, and its stamp must increase, so that no pose that was
heard once can be said again. Pure; the time is an argument.
"""

import hashlib
import hmac
from math import inf
from pathlib import Path

from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame

from pneuarm.controllers.arm.errors import ConfigurationError, MessageRejected
from pneuarm.logs.schema.printable import printable
from pneuarm.logs.schema.topics import TIP_POSE
from pneuarm.service.configuration.tables.feedback import FeedbackConfig

#: A publisher not heard for this long (s) may be replaced by another, where none is configured.
SILENT_S = 1.0

#: How fast (s/s) two clocks may run apart without a pose looking late.
_CLOCKS_DRIFT = 1e-3

_SHORTEST_KEY_BYTES = 16

#: What a google.protobuf.Timestamp may hold: the years 1 to 9999.
_SECONDS = (-62135596800, 253402300799)


def signature(key: bytes, payload: bytes) -> bytes:
    """Return what a publisher attaches to a pose, from the content of the key file."""
    return hmac.new(key, payload, hashlib.sha256).digest()


def read_key(config: FeedbackConfig) -> bytes:
    """Return the content of the configured key file, or nothing; raises ConfigurationError."""
    if not config.tip_pose_key_file:
        return b""
    where = f"feedback.tip_pose_key_file = {config.tip_pose_key_file!r}"
    try:
        key = Path(config.tip_pose_key_file).expanduser().read_bytes().strip()
    except OSError as error:
        raise ConfigurationError(f"{where}: it cannot be read ({error.strerror})") from error
    if len(key) < _SHORTEST_KEY_BYTES:
        raise ConfigurationError(
            f"{where}: it holds {len(key)} bytes; {_SHORTEST_KEY_BYTES} or more are needed, e.g. "
            "from `head -c 32 /dev/urandom | base64`"
        )
    return key


def source_of(key: str) -> str:
    """Return the publisher's name in a key of the wire, empty where it has none."""
    return key.partition(f"/{TIP_POSE.key}/")[2]


class TipPoseSource:
    """Tells the one publisher that is believed from others, and old poses from new ones."""

    def __init__(self, name: str = "", key: bytes = b"", late_s: float = inf) -> None:
        """Believe the publisher ``name`` and ``key``; poses later than ``late_s`` are refused."""
        self.name, self._late_s = name, late_s
        self._least_delay_s = inf
        self._key = key
        self._newest = ""
        self._heard_s = -inf
        self._stamp_ns: int | None = None

    def may_be(self, source: str) -> bool:
        """Whether poses under this name are looked at: the cheapest check."""
        return not self.name or source == self.name

    @property
    def is_open(self) -> bool:
        """Whether anybody who can publish may move the arm by it."""
        return not self.name and not self._key

    def check_publisher(self, source: str, payload: bytes, attachment: bytes, now_s: float) -> None:
        """Raise MessageRejected for a pose of somebody who is not believed."""
        if not self.may_be(source):
            raise MessageRejected(
                f"the tip pose comes from {_called(source)}; feedback.tip_pose_source takes those "
                f"of '{self.name}' only, under {TIP_POSE.key}/{self.name}"
            )
        if self._key and not hmac.compare_digest(signature(self._key, payload), attachment):
            raise MessageRejected(
                "the tip pose is not signed with feedback.tip_pose_key_file: attach the "
                "HMAC-SHA256 of its payload"
            )
        if source != self._newest and now_s - self._heard_s <= SILENT_S:
            raise MessageRejected(
                f"the tip pose comes from a second publisher, {_called(source)}, besides "
                f"{_called(self._newest)}; only one may publish it: end the other, and this one "
                f"is taken after {SILENT_S:g} s of silence, or name one by feedback.tip_pose_source"
            )

    def take(self, source: str, message: PoseInFrame, now_s: float) -> None:
        """Raise MessageRejected for a pose that is not newer than the last, else count it."""
        stamp_ns = _stamp_ns(message)
        if self._key and stamp_ns is None:
            raise MessageRejected(
                "timestamp is missing; a signed tip pose needs one that increases"
            )
        counts = bool(self._key) or now_s - self._heard_s <= SILENT_S
        last_ns = self._stamp_ns
        if counts and stamp_ns is not None and last_ns is not None and stamp_ns <= last_ns:
            raise MessageRejected(
                "the tip pose is not newer than the one before: its time stamp is "
                f"{(last_ns - stamp_ns) * 1e-9:.3g} s behind; is there a second publisher?"
            )
        if stamp_ns is not None:
            self._check_late(now_s - stamp_ns * 1e-9, now_s)
        self._newest, self._heard_s = source, now_s
        self._stamp_ns = last_ns if stamp_ns is None else stamp_ns

    def _check_late(self, delay_s: float, now_s: float) -> None:
        """Raise MessageRejected for a pose that took longer than the quickest one of late.

        Two clocks have no common zero, so only the difference says something.
        """
        since_s = now_s - self._heard_s
        least_s = inf if since_s > SILENT_S else self._least_delay_s + _CLOCKS_DRIFT * since_s
        if delay_s - least_s > self._late_s:
            raise MessageRejected(
                f"the tip pose is {delay_s - least_s:.3g} s later than others of its publisher "
                f"(allowed: {self._late_s:g} s, feedback.camera_timeout_ms): its network or this "
                "machine has stalled"
            )
        self._least_delay_s = min(least_s, delay_s)


def _called(source: str) -> str:
    return f"'{printable(source, 64)}'" if source else "one without a name"


def _stamp_ns(message: PoseInFrame) -> int | None:
    """Return the stamp, or None; raises MessageRejected for one that is no time."""
    if not message.HasField("timestamp"):
        return None
    seconds, nanos = message.timestamp.seconds, message.timestamp.nanos
    if not (_SECONDS[0] <= seconds <= _SECONDS[1] and 0 <= nanos < 1_000_000_000):
        raise MessageRejected(
            f"timestamp = {seconds} s and {nanos} ns is no time; allowed: the years 1 to 9999, and "
            "0 to 999999999 ns"
        )
    return seconds * 1_000_000_000 + nanos if seconds or nanos else None
