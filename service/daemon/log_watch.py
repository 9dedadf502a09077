"""The supervisor's eye on the log: what it lacks, and that it is about to lack something."""

from dataclasses import dataclass

from pneuarm.logs.rings.ring import RingReader
from pneuarm.logs.rings.rings import Rings
from pneuarm.logs.rings.status import FAR_BEHIND, RecorderStatus

#: It is told no more often than this (s) that more and more is lost.
_TELL_EVERY_S = 5.0

_BUSY = "the recorder does not get enough of the processor or the disk"
_REMEDY = "end other programs, or lower control.rate_hz; `pneuarm doctor` measures both"


@dataclass(frozen=True)
class LogTrouble:
    """What is to be told of the log."""

    code: str
    text: str
    cause: str = _BUSY
    remedy: str = _REMEDY


class LogWatch:
    """Compares what was written into the rings with what the recorder has written down."""

    def __init__(self, rings: Rings, status: RecorderStatus) -> None:
        self._status, self._capacity = status, rings.ticks.capacity
        self._heads = [RingReader(memory) for memory in (rings.ticks, *rings.messages())]
        self._told_missed, self._told_behind, self._told_s = 0, False, -_TELL_EVERY_S

    def look(self, now_s: float) -> LogTrouble | None:
        """Return what is new: that records were lost, or that the recorder is far behind."""
        missed, behind = self._status.missed, self._status.behind
        if missed > self._told_missed and now_s - self._told_s >= _TELL_EVERY_S:
            self._told_missed, self._told_s = missed, now_s
            return LogTrouble("log_lacks", f"the log lacks {self._amounts()} until now")
        if self._told_behind:
            self._told_behind = behind > FAR_BEHIND * self._capacity / 4
        elif behind > FAR_BEHIND * self._capacity:
            self._told_behind = True
            return LogTrouble(
                "log_behind",
                f"the log is {behind} ticks behind; when it is {self._capacity} behind, ticks are "
                "lost; until it catches up it holds no tip, tf and body",
            )
        return None

    def recorded(self) -> object:
        """Say how far the recorder is: another value whenever it got further."""
        return self._status.progress(len(self._heads) - 1), self._status.missed

    def lacks(self) -> str:
        """Say, after the end, what is not in the log; empty where nothing is."""
        next_tick, next_messages, _ = self._status.progress(len(self._heads) - 1)
        positions = (max(1, next_tick), *next_messages)
        left = [head.head() + 1 - at for head, at in zip(self._heads, positions, strict=True)]
        ticks = self._status.missed_ticks + left[0]
        messages = self._status.missed_messages + sum(left[1:])
        return f"the log lacks {_amounts(ticks, messages)}" if ticks or messages else ""

    def _amounts(self) -> str:
        return _amounts(self._status.missed_ticks, self._status.missed_messages)


def _amounts(ticks: int, messages: int) -> str:
    return f"{ticks} ticks and {messages} messages"
