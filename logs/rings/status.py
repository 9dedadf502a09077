"""What recorder and viewer tell the other processes: a few numbers in shared memory."""

from dataclasses import dataclass
from enum import IntEnum
from multiprocessing.context import SpawnContext
from multiprocessing.sharedctypes import RawArray
from typing import Any

#: Behind by this share of the ring the recorder writes ticks and messages, and nothing that can be
#: computed from them.
FAR_BEHIND = 1 / 2


class Disk(IntEnum):
    """State of the recording."""

    STARTING = 0
    OK = 1
    LOW = 2  # less free space than configured: enabling is refused
    FULL = 3  # the disk takes nothing: the arm holds, then vents


@dataclass(frozen=True)
class RecorderStatus:
    """Written by the recorder alone, read by all; every value is one aligned 64-bit word.

    What is lost is counted over all recorders of a session, however often one was started again.
    """

    words: Any

    @classmethod
    def create(cls, context: SpawnContext) -> "RecorderStatus":
        """Make the shared words, all zero."""
        return cls(RawArray("q", 16))

    def publish(
        self,
        disk: Disk,
        free_bytes: int,
        missed_ticks: int = 0,
        missed_messages: int = 0,
        behind: int = 0,
    ) -> None:
        """Say how the recording stands; a recorder's own losses come to those before it."""
        self.words[0], self.words[1] = int(disk), free_bytes
        self.words[2], self.words[3] = missed_ticks, missed_messages
        self.words[15] = behind

    def publish_progress(self, next_tick: int, next_messages: list[int], next_part: int) -> None:
        """Say from where a successor would have to go on, once it is on the disk."""
        self.words[4], self.words[5] = next_tick, next_part
        for index, sequence in enumerate(next_messages):
            self.words[6 + index] = sequence

    @property
    def disk(self) -> Disk:
        """State of the recording."""
        return Disk(self.words[0])

    @property
    def free_bytes(self) -> int:
        """Free space in the sessions' directory."""
        return int(self.words[1])

    @property
    def missed_ticks(self) -> int:
        """Ticks that were overwritten before they were written down."""
        return int(self.words[2])

    @property
    def missed_messages(self) -> int:
        """Records of messages, events among them, that were overwritten."""
        return int(self.words[3])

    @property
    def behind(self) -> int:
        """Ticks that were not yet written down when the recorder last looked."""
        return int(self.words[15])

    @property
    def missed(self) -> int:
        """Records lost, ticks and messages together."""
        return self.missed_ticks + self.missed_messages

    def progress(self, n_rings: int) -> tuple[int, list[int], int]:
        """Next tick, next message of every ring, next part; 0 where nothing was written yet."""
        return (
            int(self.words[4]),
            [max(1, int(self.words[6 + index])) for index in range(n_rings)],
            int(self.words[5]),
        )


@dataclass(frozen=True)
class ViewerStatus:
    """Written by the viewer alone: how many ticks it has skipped."""

    words: Any

    @classmethod
    def create(cls, context: SpawnContext) -> "ViewerStatus":
        """Make the shared word."""
        return cls(RawArray("q", 1))

    @property
    def skipped(self) -> int:
        """Ticks that were never shown."""
        return int(self.words[0])

    def publish(self, skipped: int) -> None:
        """Say how many ticks were skipped so far."""
        self.words[0] = skipped
