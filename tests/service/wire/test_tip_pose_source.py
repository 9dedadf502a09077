"""Who may measure the tip: the time is an argument."""

from pathlib import Path

import pytest
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.arm.errors import ConfigurationError, MessageRejected
from pneuarm.service.configuration.tables.feedback import FeedbackConfig
from pneuarm.service.wire.tip_pose_source import (
    SILENT_S,
    TipPoseSource,
    read_key,
    signature,
    source_of,
)

KEY = b"a secret of some length"


def pose(stamp_ns: int = 0) -> PoseInFrame:
    message = PoseInFrame(frame_id="base")
    if stamp_ns:
        message.timestamp.FromNanoseconds(stamp_ns)
    return message


def take(source: TipPoseSource, name: str, stamp_ns: int, now_s: float, key: bytes = b"") -> None:
    message = pose(stamp_ns)
    payload = message.SerializeToString()
    attached = signature(key, payload) if key else b""
    source.check_publisher(name, payload, attached, now_s)
    source.take(name, message, now_s)


def test_the_name_is_what_follows_in_the_key() -> None:
    assert source_of("pneuarm/paper/sensor/tip_pose/mocap") == "mocap"
    assert source_of("pneuarm/paper/sensor/tip_pose/a/b") == "a/b"
    assert source_of("pneuarm/paper/sensor/tip_pose") == ""


def test_without_a_configured_one_the_first_is_believed_until_it_is_silent() -> None:
    source = TipPoseSource()
    assert source.is_open
    take(source, "a", 0, 1.0)
    take(source, "a", 5_000, 1.1)
    for other in ("b", ""):
        with pytest.raises(MessageRejected, match="second publisher"):
            take(source, other, 6_000, 1.2)
    with pytest.raises(MessageRejected, match="not newer"):
        take(source, "a", 5_000, 1.3)
    take(source, "b", 1_000, 1.2 + 2 * SILENT_S)
    with pytest.raises(MessageRejected, match="second publisher"):
        take(source, "a", 7_000, 1.3 + 2 * SILENT_S)


def test_the_configured_one_is_believed_and_nobody_else_however_silent_it_is() -> None:
    source = TipPoseSource("mocap")
    assert not source.is_open
    for now_s in (0.0, 1000.0):
        for other in ("", "b", "mocap2", "mocap/x", "Mocap"):
            with pytest.raises(MessageRejected) as caught:
                take(source, other, 0, now_s)
            for fact in ("feedback.tip_pose_source", "'mocap'", "sensor/tip_pose/mocap"):
                assert fact in str(caught.value)
        take(source, "mocap", 0, now_s)


def test_a_pose_that_is_refused_later_keeps_no_other_out() -> None:
    source = TipPoseSource()
    source.check_publisher("a", b"", b"", 1.0)
    take(source, "b", 0, 1.1)


@pytest.mark.parametrize("key", [b"", b"another key of the same length", KEY + b"x"])
def test_a_signed_source_takes_no_pose_without_its_signature(key: bytes) -> None:
    source = TipPoseSource("mocap", KEY)
    with pytest.raises(MessageRejected, match=r"feedback\.tip_pose_key_file.*HMAC-SHA256"):
        take(source, "mocap", 1, 0.0, key)
    take(source, "mocap", 1, 0.0, KEY)


def test_a_signed_pose_is_taken_once_whenever_it_is_said_again() -> None:
    source = TipPoseSource("mocap", KEY)
    take(source, "mocap", 1_000, 0.0, KEY)
    for stamp_ns in (1_000, 999, 0):
        with pytest.raises(MessageRejected, match=r"not newer|timestamp is missing"):
            take(source, "mocap", stamp_ns, 3600.0, KEY)
    take(source, "mocap", 1_001, 3600.0, KEY)


def test_a_signature_is_of_its_payload_alone() -> None:
    source = TipPoseSource("", KEY)
    assert not source.is_open
    with pytest.raises(MessageRejected):
        source.check_publisher("", b"one", signature(KEY, b"other"), 0.0)
    source.check_publisher("", b"one", signature(KEY, b"one"), 0.0)


@given(st.integers(-(2**63), 2**63 - 1), st.integers(-(2**31), 2**31 - 1))
def test_any_stamp_is_taken_or_refused_in_one_sentence(seconds: int, nanos: int) -> None:
    message = PoseInFrame()
    message.timestamp.seconds, message.timestamp.nanos = seconds, nanos
    valid = -62135596800 <= seconds <= 253402300799 and 0 <= nanos < 10**9
    if valid:
        TipPoseSource().take("a", message, 0.0)
        return
    with pytest.raises(MessageRejected) as caught:
        TipPoseSource().take("a", message, 0.0)
    assert f"{seconds} s and {nanos} ns" in str(caught.value)


def test_a_key_file_that_is_missing_or_short_is_refused_before_anything_starts(
    tmp_path: Path,
) -> None:
    path = tmp_path / "key"
    config = FeedbackConfig(tip_pose_key_file=str(path))
    with pytest.raises(ConfigurationError, match=r"^feedback\.tip_pose_key_file = .*cannot"):
        read_key(config)
    path.write_bytes(b"short\n")
    with pytest.raises(ConfigurationError, match=r"holds 5 bytes; 16 or more"):
        read_key(config)
    path.write_bytes(KEY + b"\n")
    assert read_key(config) == KEY
    assert read_key(FeedbackConfig()) == b""
