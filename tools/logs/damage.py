"""Random damage to logs of several kinds, and what reader and mending make of it.

    python -m tools.logs.damage --times 10000

A log's truth is read by the MCAP library from the file before the damage. After it no number may
be given that is not true, no chunk may be lost whose bytes are still there, what is missing must
be told, and mending may lose nothing: no message, and no original of which it dropped a byte.
"""

import argparse
import contextlib
import random
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from mcap.exceptions import EndOfFile
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import MCAP0_MAGIC

from pneuarm.controllers.arm.errors import LogError
from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.reading.summary import summarise
from pneuarm.logs.recording.chunked_file import to_bytes
from pneuarm.logs.recording.repair import repair
from pneuarm.logs.recording.session import unfinished
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import split_key
from tools.rig.arms import ARMS
from tools.rig.recording import make_session

#: Key, time and bytes of a message.
Found = tuple[str, int, bytes]


@dataclass(frozen=True)
class Sample:
    """A log before the damage: its files, and what stands in each of its chunks."""

    kind: str
    files: dict[str, bytes]
    chunks: list[tuple[str, bytes, list[Found]]]

    @property
    def first(self) -> str:
        """Name of the first part."""
        return min(self.files, key=len)

    def messages(self) -> Iterable[Found]:
        """Yield everything that was written."""
        return (message for _, _, found in self.chunks for message in found)

    def last_tick(self) -> int:
        """Return the number of the newest tick."""
        return max(map(_number, self.messages()))


def _number(message: Found) -> int:
    return pb.ArmState.FromString(message[2]).sequence if message[0] == "state" else 0


def record(kind: str, folder: Path, flushes: int = 8, ticks: int = 40) -> Sample:
    """Record a log: closed, crashed, parts, trunk (three sections) or plain (not compressed)."""
    with pytest.MonkeyPatch.context() as patch:
        session = make_session(folder, patch, ARMS["trunk"] if kind == "trunk" else None)
        if kind == "parts":
            session.configure(roll_bytes=60_000)
        recorder = session.recorder()
        if kind == "plain":
            recorder._part.compress = False
            patch.setattr(recorder, "_shed_if_behind", lambda: None)
        for _ in range(flushes):
            session.write_ticks(ticks)
            session.write_events(2)
            session.flush(recorder)
        if kind != "crashed":
            recorder.finish()
    files = {path.name: path.read_bytes() for path in sorted(folder.glob("*.mcap"))}
    return Sample(kind, files, [(n, *chunk) for n in files for chunk in _chunks(folder / n)])


KINDS = ("closed", "crashed", "parts", "trunk", "plain")


def _chunks(path: Path) -> list[tuple[bytes, list[Found]]]:
    """Return every chunk and its messages, as the MCAP library reads them."""
    found, channels = [], {}
    with path.open("rb") as file, contextlib.suppress(EndOfFile):  # of a log that broke off
        for chunk in StreamReader(file, emit_chunks=True, validate_crcs=True).records:
            if not isinstance(chunk, Chunk):
                continue
            messages = []
            for each in breakup_chunk(chunk, validate_crc=True):
                if isinstance(each, Channel):
                    channels[each.id] = split_key(each.topic)[1]
                elif isinstance(each, Message):
                    messages.append((channels[each.channel_id], each.log_time, each.data))
            found.append((to_bytes(chunk), messages))
    return found


Harm = Callable[[bytes, random.Random, Sequence[bytes]], bytes]


def _cut(data: bytes, chance: random.Random, chunks: Sequence[bytes]) -> bytes:
    return data[: chance.randrange(len(data))]


def _flip(data: bytes, chance: random.Random, chunks: Sequence[bytes]) -> bytes:
    harmed = bytearray(data)
    for _ in range(chance.choice((1, 1, 1, 3))):
        harmed[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    return bytes(harmed)


def _zero(data: bytes, chance: random.Random, chunks: Sequence[bytes]) -> bytes:
    size = chance.choice((1, 8, 64, 512, 4096))
    at = chance.randrange(len(data))
    at -= chance.choice((0, at % 512))  # disks lose blocks
    return data[:at] + bytes(min(size, len(data) - at)) + data[at + size :]


def _overwrite(data: bytes, chance: random.Random, chunks: Sequence[bytes]) -> bytes:
    at, size = chance.randrange(len(data)), chance.choice((1, 16, 512))
    return data[:at] + chance.randbytes(min(size, len(data) - at)) + data[at + size :]


def _take_out(data: bytes, chance: random.Random, chunks: Sequence[bytes]) -> bytes:
    at = chance.randrange(len(data))
    return data[:at] + data[at + chance.choice((1, 100, 5000)) :]


def _swap(data: bytes, chance: random.Random, chunks: Sequence[bytes]) -> bytes:
    if len(chunks) < 2:
        return _flip(data, chance, chunks)
    one, other = sorted(chance.sample(range(len(chunks)), 2))
    first, second = data.index(chunks[one]), data.index(chunks[other])
    between = data[first + len(chunks[one]) : second]
    rest = data[second + len(chunks[other]) :]
    return data[:first] + chunks[other] + between + chunks[one] + rest


HARMS: dict[str, Harm] = {
    "cut": _cut,
    "flip": _flip,
    "zero": _zero,
    "overwrite": _overwrite,
    "take out": _take_out,
    "swap": _swap,
}


@dataclass
class Verdict:
    """What went wrong; empty where nothing did."""

    wrong_numbers: list[str] = field(default_factory=list)
    lost_chunks: list[str] = field(default_factory=list)
    lost_originals: list[str] = field(default_factory=list)

    def all(self) -> list[str]:
        """Return everything that went wrong."""
        return [*self.wrong_numbers, *self.lost_chunks, *self.lost_originals]


def try_one(sample: Sample, folder: Path, seed: int) -> Verdict:
    """Damage one file of a log at random, read it, mend it, read it again."""
    chance = random.Random(seed)
    files = dict(sample.files)
    name = chance.choice(sorted(files))
    harm = chance.choice(sorted(HARMS))
    chunks = [raw for part, raw, _ in sample.chunks if part == name]
    files[name] = HARMS[harm](files[name], chance, chunks)
    for part, content in files.items():
        (folder / part).write_bytes(content)
    verdict = Verdict()
    what = f"{sample.kind}, {harm} in {name}, seed {seed}"
    before = _read(sample, folder, files, verdict, what)
    _mend(sample, folder, files, before, verdict, what)
    for path in folder.iterdir():
        path.unlink()
    return verdict


def _read(
    sample: Sample, folder: Path, files: dict[str, bytes], verdict: Verdict, what: str
) -> "Counter[Found]":
    """Compare what is read with the truth, with what is still there, and with what is told."""
    truth = Counter(sample.messages())
    good: Counter[Found] = Counter()
    for part, raw, messages in sample.chunks:
        if raw in files[part]:
            good.update(messages)
    try:
        reader = LogReader(folder / sample.first)
        found = Counter((raw.topic.key, raw.time_unix_ns, raw.payload) for raw in reader.raw())
        summary = summarise(reader)
    except LogError as error:
        if good:
            verdict.lost_chunks.append(f"{what}: {error}")
        return Counter()
    if found - truth:
        verdict.wrong_numbers.append(f"{what}: {len(found - truth)} messages nobody wrote")
    if good - found:
        verdict.lost_chunks.append(f"{what}: {sum((good - found).values())} messages")
    ticks = {_number(message) for message in found if message[0] == "state"}
    if summary.ticks != len(ticks) or summary.messages != _by_key(found):
        verdict.wrong_numbers.append(f"{what}: {summary.ticks} ticks instead of {len(ticks)}")
    told = bool(summary.damage or summary.lost or summary.missing_ticks or not summary.finished)
    if truth - found and not told:
        verdict.wrong_numbers.append(f"{what}: not told that anything is missing")
    known = summary.ticks + summary.missing_ticks
    if known > sample.last_tick() or (known < sample.last_tick() and summary.finished):
        verdict.wrong_numbers.append(f"{what}: {known} ticks told of {sample.last_tick()}")
    return found


def _by_key(found: "Counter[Found]") -> dict[str, int]:
    counts: Counter[str] = Counter()
    for (key, _, _), number in found.items():
        counts[key] += number
    return dict(counts)


def _only_cut(sample: Sample, damaged: bytes, mended: Path) -> bool:
    """Say whether all that mending dropped is one piece at the end, of which the rest is gone."""
    one, other = (np.frombuffer(data, np.uint8) for data in (damaged, mended.read_bytes()))
    size = min(len(one), len(other))
    differ = np.flatnonzero(one[:size] != other[:size])
    dropped = damaged[differ[0] if len(differ) else size :]
    if dropped.endswith(MCAP0_MAGIC) or any(raw in dropped for _, raw, _ in sample.chunks):
        return False
    return len(dropped) < max(len(raw) for _, raw, _ in sample.chunks)


def _mend(
    sample: Sample,
    folder: Path,
    files: dict[str, bytes],
    before: "Counter[Found]",
    verdict: Verdict,
    what: str,
) -> None:
    """Mend as the daemon does; nothing that could be read before may be unreadable after it."""
    for path in unfinished(folder):
        mended = repair(path)
        if mended.kept is not None and mended.kept.read_bytes() != files[path.name]:
            verdict.lost_originals.append(f"{what}: {mended.kept.name} is not the original")
        if mended.kept is None and not _only_cut(sample, files[path.name], path):
            verdict.lost_originals.append(f"{what}: {path.name} was changed and is not kept")
        if mended.path is not None:
            with mended.path.open("rb") as file:
                list(make_reader(file, validate_crcs=True).iter_messages())
    if before:
        again = LogReader(folder / sample.first).raw()
        after = Counter((raw.topic.key, raw.time_unix_ns, raw.payload) for raw in again)
        if before - after:
            lost = sum((before - after).values())
            verdict.lost_chunks.append(f"{what}: mending lost {lost} messages")


def main() -> int:
    """Try as often as asked for; say what went wrong, or that nothing did."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    total = Verdict()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        samples = [record(kind, folder / kind) for kind in KINDS]
        place = folder / "damaged"
        place.mkdir()
        for number in range(arguments.times):
            seed = arguments.seed + number
            verdict = try_one(samples[number % len(samples)], place, seed)
            for line in verdict.all():
                print(line, flush=True)
            total.wrong_numbers += verdict.wrong_numbers
            total.lost_chunks += verdict.lost_chunks
            total.lost_originals += verdict.lost_originals
    print(
        f"{arguments.times} damages: {len(total.wrong_numbers)} wrong numbers without a word, "
        f"{len(total.lost_chunks)} with good chunks lost, "
        f"{len(total.lost_originals)} with an original lost"
    )
    return 1 if total.all() else 0


if __name__ == "__main__":
    sys.exit(main())
