"""Damaged logs: nothing false is given, nothing good is lost, and what is missing is told."""

import resource
import struct
import time
import zlib
from pathlib import Path

import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.records import Chunk
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer

from pneuarm.controllers.arm.errors import LogError
from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.reading.summary import summarise
from pneuarm.logs.reading.walk import GoodChunk, read_summary, walk
from pneuarm.logs.recording.chunked_file import to_bytes
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import full_key
from tools.logs.damage import KINDS, Sample, record, try_one

SEED = st.integers(0, 10**9)


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Sample]:
    return {kind: record(kind, tmp_path_factory.mktemp(kind)) for kind in KINDS}


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=15)
@given(seed=SEED)
def test_random_damage(
    samples: dict[str, Sample], tmp_path_factory: pytest.TempPathFactory, kind: str, seed: int
) -> None:
    verdict = try_one(samples[kind], tmp_path_factory.mktemp("damaged"), seed)
    assert verdict.all() == []


def chunk_ends(path: Path) -> list[int]:
    found = [piece for piece in walk(path) if isinstance(piece, GoodChunk)]
    return [piece.offset + len(piece.raw) for piece in found]


@pytest.mark.parametrize("first", range(1, 9))
def test_a_closed_log_tells_what_is_missing_to_its_end(
    samples: dict[str, Sample], tmp_path: Path, first: int
) -> None:
    """All chunks from one on are damaged: how many ticks there were is known all the same."""
    sample = samples["closed"]
    path = tmp_path / "log.mcap"
    path.write_bytes(sample.files[sample.first])
    damaged = bytearray(path.read_bytes())
    for end in chunk_ends(path)[first:]:
        damaged[end - 10] ^= 1
    path.write_bytes(damaged)
    summary = summarise(LogReader(path))
    assert summary.ticks == 40 * (first - 1)
    assert summary.ticks + summary.missing_ticks == sample.last_tick() == 320
    assert summary.lost["state"] == summary.missing_ticks
    assert len(summary.damage) >= 1


def test_a_log_of_which_nothing_is_readable_is_refused(
    samples: dict[str, Sample], tmp_path: Path
) -> None:
    path = tmp_path / "log.mcap"
    content = samples["closed"].files[samples["closed"].first]
    path.write_bytes(content[:8] + bytes(len(content) - 8))
    with pytest.raises(LogError, match=r"log\.mcap"):
        LogReader(path)


def with_chunk(path: Path, chunk: Chunk) -> Path:
    """Write a log whose second chunk is what it should not be."""
    with path.open("r+b") as file:
        file.seek(0, 2)
        file.write(to_bytes(chunk))
    return path


@pytest.mark.parametrize("claimed", [1 << 32, 1 << 40, 4 * 1024**3 - 1, 1 << 20])
def test_a_small_file_does_not_fill_the_memory(
    samples: dict[str, Sample], tmp_path: Path, claimed: int
) -> None:
    """Gigabytes of zeros in kilobytes, whatever the chunk says of its own size."""
    path = tmp_path / "log.mcap"
    path.write_bytes(samples["crashed"].files[samples["crashed"].first])
    ticks = len(LogReader(path).ticks())
    packer = zstandard.ZstdCompressor(level=1).compressobj()
    piece = bytes(1 << 20)
    data = b"".join(packer.compress(piece) for _ in range(1024)) + packer.flush()
    with_chunk(path, Chunk("zstd", data, 1, 1, zlib.crc32(piece), claimed))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    reader = LogReader(path)
    assert len(reader.ticks()) == ticks
    assert len(reader.damage) == 1
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200 * 1024


@pytest.mark.parametrize("compression", [CompressionType.ZSTD, CompressionType.LZ4])
def test_logs_of_the_librarys_writer_are_read(tmp_path: Path, compression: CompressionType) -> None:
    """Older logs name their channels only once; a closed one in its summary too."""
    path = others_log(tmp_path / "log.mcap", compression=compression)
    assert summarise(LogReader(path)).missing_ticks == 0
    damaged = bytearray(path.read_bytes())
    damaged[chunk_ends(path)[0] - 5] ^= 1
    path.write_bytes(damaged)
    summary = summarise(LogReader(path))
    assert 0 < summary.ticks < 2000
    assert summary.ticks + summary.missing_ticks == 2000


def others_log(path: Path, ticks: int = 2000, **options: object) -> Path:
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=4096, **options)  # type: ignore[arg-type]
        writer.start()
        channel = writer.register_channel(full_key("paper", "state"), "protobuf", 0)
        for tick in range(1, ticks + 1):
            state = pb.ArmState(sequence=tick, n_sections=1, time_unix_ns=tick)
            writer.add_message(channel, tick, state.SerializeToString(), tick, tick)
        writer.finish()
    return path


@pytest.mark.parametrize("checked", [False, True])
@settings(max_examples=15)
@given(place=st.floats(0.1, 0.4), bit=st.integers(0, 7))
def test_messages_outside_of_chunks_are_checked_by_all_data_or_called_unchecked(
    tmp_path_factory: pytest.TempPathFactory, checked: bool, place: float, bit: int
) -> None:
    path = tmp_path_factory.mktemp("loose") / "log.mcap"
    others_log(path, ticks=200, use_chunking=False, enable_data_crcs=checked)
    assert bool(told(path)) is not checked
    damaged = bytearray(path.read_bytes())
    damaged[int(place * len(damaged))] ^= 1 << bit
    path.write_bytes(damaged)
    assert told(path)


def told(path: Path) -> list[str]:
    """What is told but that this log has no facts."""
    return [text for text in summarise(LogReader(path)).damage if "configuration" not in text]


def test_a_summary_counts_only_with_its_checksum(
    samples: dict[str, Sample], tmp_path: Path
) -> None:
    path = tmp_path / "log.mcap"
    content = samples["closed"].files[samples["closed"].first]
    path.write_bytes(content)
    assert read_summary(path) is not None
    (start,) = struct.unpack_from("<Q", content, len(content) - 28)
    for place in (start + 20, len(content) - 60, len(content) - 20, len(content) - 1):
        damaged = bytearray(content)
        damaged[place] ^= 4
        path.write_bytes(damaged)
        assert read_summary(path) is None
        assert not LogReader(path).finished


def test_what_looks_like_a_record_again_and_again_is_tried_once(tmp_path: Path) -> None:
    """From each of them everything before was tried anew: minutes for 30 kB."""
    path, record, times = tmp_path / "log.mcap", b"\x0f" + struct.pack("<Q", 4) + b"abcd", 3000
    path.write_bytes(MCAP0_MAGIC + (record + b"\xee") * times)
    begun_s = time.process_time()
    assert sum(1 for _ in walk(path)) == 2 * times + 1
    assert time.process_time() - begun_s < 10.0
