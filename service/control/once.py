"""What can repeat in any tick is told once, and then every few seconds how often it came again."""

from dataclasses import dataclass, replace

from pneuarm.service.modes.mode_keeper import Notice


@dataclass
class _Told:
    at_s: float
    newest: Notice | None = None
    times: int = 0


class Once:
    """Passes the first notice of a code on at once, counts the ones after it.

    What came again is told ``EVERY_S`` after the telling before: the newest of it, and how often.
    Pure; the time is an argument.
    """

    EVERY_S = 10.0

    def __init__(self) -> None:
        self._told: dict[str, _Told] = {}

    def take(self, notice: Notice, now_s: float) -> Notice | None:
        """Take a notice; return it if it is news, None if it is counted."""
        known = self._told.get(notice.code)
        if known is None:
            self._told[notice.code] = _Told(now_s)
            return notice
        known.newest, known.times = notice, known.times + 1
        return None

    def due(self, now_s: float) -> list[Notice]:
        """Return what is to be told by now; call it once a tick. What stays away is forgotten."""
        notices: list[Notice] = []
        if not self._told:
            return notices
        for code, told in list(self._told.items()):
            if now_s - told.at_s < self.EVERY_S:
                continue
            if told.newest is None:
                del self._told[code]
                continue
            text = f"{told.newest.text}; {told.times} times in {now_s - told.at_s:.0f} s"
            notices.append(replace(told.newest, text=text))
            self._told[code] = _Told(now_s)
        return notices
