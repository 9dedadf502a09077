"""Measured tip poses come from one publisher: the first, until it has been silent for a while."""

import zenoh
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame

from pneuarm.controllers.arm.errors import MessageRejected

#: A publisher not heard for this long (s) may be replaced by another.
SILENT_S = 1.0


class PosePublisher:
    """Tells publishers apart by Zenoh's source, and old poses from new ones by their stamp.

    Not every publisher names its source; then two of them on one clock are told apart only by
    stamps that run backwards, or by the jumps between what they measure.
    """

    def __init__(self) -> None:
        self._source = ""
        self._heard_s = -SILENT_S
        self._stamp_ns = 0

    def check(self, sample: zenoh.Sample, message: PoseInFrame, now_s: float) -> None:
        """Raise MessageRejected for a pose of a second publisher, or one older than the last."""
        info = sample.source_info
        source = "" if info is None else f"{info.source_id.zid}/{info.source_id.eid}"
        stamp_ns = message.timestamp.ToNanoseconds() if message.HasField("timestamp") else 0
        self.check_source(source, stamp_ns, now_s)

    def check_source(self, source: str, stamp_ns: int, now_s: float) -> None:
        """As :meth:`check`, from plain values; a stamp of 0 is none."""
        silent = now_s - self._heard_s > SILENT_S
        if not silent and source != self._source:
            raise MessageRejected(
                f"the tip pose comes from a second publisher ({source or 'without a name'}); only "
                "one may publish it: end the other, and this one is taken after "
                f"{SILENT_S:g} s of silence"
            )
        if not silent and stamp_ns and stamp_ns <= self._stamp_ns:
            raise MessageRejected(
                "the tip pose is not newer than the one before: its time stamp is "
                f"{(self._stamp_ns - stamp_ns) * 1e-9:.3g} s behind; is there a second publisher?"
            )
        self._source, self._heard_s = source, now_s
        self._stamp_ns = stamp_ns or self._stamp_ns
