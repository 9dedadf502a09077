"""Keeps which faults are there, tells each once, and lets its policy change the mode."""

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.modes.mode import ModeEvent
from pneuarm.service.modes.mode_keeper import ModeKeeper, Notice
from pneuarm.service.safety.faults import EVENTS, FAULTS, Fault, FaultCode, Policy

#: A warning that lasts is told again after this long, and nothing sooner, however it flickers.
REPEAT_S = 10.0


class FaultKeeper:
    """What is wrong now; what was wrong stays in the mode, latched."""

    def __init__(self, keeper: ModeKeeper) -> None:
        self._keeper = keeper
        self._seen: dict[FaultCode, str] = {}
        self._failed: dict[FaultCode, str] = {}
        self._told_s: dict[FaultCode, float] = {}

    @property
    def active(self) -> dict[FaultCode, str]:
        """Every fault that is there now, with what was seen: failed calls and the monitors'."""
        return self._failed | self._seen

    @property
    def bits(self) -> int:
        """The active faults as bits on the wire."""
        if not self._failed and not self._seen:
            return 0
        return sum(1 << code for code in self.active)

    def seen(self, found: dict[FaultCode, str], now_s: float) -> None:
        """Take what the monitors see in this tick; what they no longer see is gone."""
        before, self._seen = self._seen, found
        for code, what in found.items():
            lasts = code in before or code in self._failed
            if not lasts or FAULTS[code].policy == Policy.WARN:
                self._act(code, what, now_s, again=lasts)

    def failed(self, code: FaultCode, what: str, now_s: float) -> None:
        """Take a call or a tick that failed; it is there until :meth:`worked`."""
        lasts = code in self.active
        self._failed = {code: what}  # of the one before nothing is known any more
        self._act(code, what, now_s, again=lasts)

    def worked(self) -> None:
        """A whole tick went through: what had failed works again."""
        if self._failed:
            self._failed = {}

    def _act(self, code: FaultCode, what: str, now_s: float, again: bool) -> None:
        """Change the mode as the policy says; tell it once, with the change or without."""
        fault = FAULTS[code]
        event = EVENTS[fault.policy]
        notice = _notice(code, fault, what)
        before = self._keeper.mode
        if event is not None:
            self._keeper.apply(event, now_s, notice=notice)
        if self._keeper.mode != before:
            self._told_s[code] = now_s
        elif now_s - self._told_s.get(code, -REPEAT_S) >= REPEAT_S and (
            not again or fault.policy == Policy.WARN
        ):
            self._told_s[code] = now_s
            self._keeper.tell(notice)

    def why_not(self, event: ModeEvent) -> str:
        """Say what still forbids to enable or to reset, or return an empty string."""
        if event not in (ModeEvent.ENABLE, ModeEvent.RESET):
            return ""
        for code, what in self.active.items():
            if FAULTS[code].policy > Policy.WARN:
                return f"{code.name.lower()} is still there: {what}; {FAULTS[code].remedy}"
        return ""

    def ramps(self) -> bool:
        """Whether what is there asks for a ramp, and nothing to vent at once."""
        return self._worst() == Policy.RAMP

    def vents(self) -> bool:
        """Whether something that is there asks to vent at once."""
        return self._worst() >= Policy.VENT

    def _worst(self) -> Policy:
        return max((FAULTS[code].policy for code in self.active), default=Policy.WARN)


def _notice(code: FaultCode, fault: Fault, what: str) -> Notice:
    serious = fault.policy >= Policy.RAMP
    level = pb.ERROR if serious else pb.WARNING
    text = f"{fault.cause}; {fault.consequence}"
    return Notice(level, code.name.lower(), text, what, fault.remedy)
