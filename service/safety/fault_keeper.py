"""Keeps which faults are there, tells each once, and lets its policy change the mode."""

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.modes.mode import ModeEvent
from pneuarm.service.modes.mode_keeper import ModeKeeper, Notice
from pneuarm.service.monitors.fault import Fault, Policy

#: A warning that lasts is told again after this long, and nothing sooner, however it flickers.
REPEAT_S = 10.0


class FaultKeeper:
    """What is wrong now; what was wrong stays in the mode, latched."""

    def __init__(self, keeper: ModeKeeper) -> None:
        self._keeper = keeper
        self._seen: dict[Fault, str] = {}
        self._failed: dict[Fault, str] = {}
        self._told_s: dict[Fault, float] = {}

    @property
    def active(self) -> dict[Fault, str]:
        """Every fault that is there now, with what was seen: failed calls and the monitors'."""
        return self._failed | self._seen

    @property
    def bits(self) -> int:
        """The active faults as bits on the wire."""
        return sum(1 << fault.bit for fault in self.active)

    def seen(self, found: dict[Fault, str], now_s: float) -> None:
        """Take what the monitors see in this tick; what they no longer see is gone."""
        before, self._seen = self._seen, found
        for fault, what in found.items():
            self._act(fault, what, now_s, again=fault in before or fault in self._failed)

    def failed(self, fault: Fault, what: str, now_s: float) -> None:
        """Take a call or a tick that failed; it is there until :meth:`worked`."""
        lasts = fault in self.active
        self._failed = {fault: what}  # of the one before nothing is known any more
        self._act(fault, what, now_s, again=lasts)

    def worked(self) -> None:
        """A whole tick went through: what had failed works again."""
        self._failed = {}

    def _act(self, fault: Fault, what: str, now_s: float, again: bool) -> None:
        """Change the mode as the policy says; tell it once, with the change or without."""
        notice, before = _notice(fault, what), self._keeper.mode
        if fault.policy.event is not None:
            self._keeper.apply(fault.policy.event, now_s, notice=notice)
        if self._keeper.mode != before:
            self._told_s[fault] = now_s
        elif now_s - self._told_s.get(fault, -REPEAT_S) >= REPEAT_S and (
            not again or fault.policy == Policy.WARN
        ):
            self._told_s[fault] = now_s
            self._keeper.tell(notice)

    def why_not(self, event: ModeEvent) -> str:
        """Say what still forbids to enable or to reset, or return an empty string."""
        if event not in (ModeEvent.ENABLE, ModeEvent.RESET):
            return ""
        for fault, what in self.active.items():
            if fault.policy > Policy.WARN:
                return f"{fault.code} is still there: {what}; {fault.remedy}"
        return ""

    def ramps(self) -> bool:
        """Whether what is there asks for a ramp, and nothing to vent at once."""
        return self._worst() == Policy.RAMP

    def vents(self) -> bool:
        """Whether something that is there asks to vent at once."""
        return self._worst() >= Policy.VENT

    def _worst(self) -> Policy:
        return max((fault.policy for fault in self.active), default=Policy.WARN)


def _notice(fault: Fault, what: str) -> Notice:
    level = pb.ERROR if fault.policy >= Policy.RAMP else pb.WARNING
    text = f"{fault.cause}; {fault.policy.consequence}"
    return Notice(level, fault.code, text, what, fault.remedy)
