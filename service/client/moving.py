"""Moves that a program waits for: to a target, and on at it.

Nothing is sent but from the program's own calls: one that hangs stops refreshing its target, and
the arm holds. From such a hold the next move goes on by itself; from one that somebody else asked
for, or that a fault caused, only `enable` does.
"""

import time
from abc import abstractmethod
from collections.abc import Iterable, Iterator, Sequence

from pneuarm.controllers.arm.errors import ModeRefused, MoveTimeout, OutOfReach, TargetRejected
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.printable import name_of, printable
from pneuarm.logs.schema.topics import TARGET
from pneuarm.service.client.sending import Sending
from pneuarm.service.client.target_messages import Vector, position_target

_REFRESH_S = 0.02

#: The limits of ``binding_limits``, by their bits.
LIMITS = {1: "length, Eq. (4)", 2: "bend", 4: "pressure", 8: "keep-out"}

#: Why an arm holds although nobody meant it to: its program paused, or the machine did.
_PAUSES = ("target_stale", "gateway_silent")

#: The event of a hold that somebody has asked for.
_HOLD = "hold"

#: A target is refused at once where the arm follows none; the state that shows it comes within (s).
_SHOWN_S = 0.05

#: Warnings that say nothing against going on.
_NO_MATTER = ("camera_lost", "loop_overruns", "mode_refused")

#: The event of a hold may come this much (s) after the state that shows it.
_TOLD_S = 1.0


class Moving(Sending):
    """Moves the arm while its calls last."""

    client_id: str
    _secret: str
    #: What was sent last.
    _target: pb.Target | None = None

    @abstractmethod
    def state(self, timeout_s: float = 2.0) -> pb.ArmState:
        """Return the newest state."""

    @abstractmethod
    def events(self) -> list[pb.Event]:
        """Return the events since the last call."""

    @abstractmethod
    def past_events(self) -> pb.Events:
        """Return what was told before."""

    @abstractmethod
    def enable(self, take_over: bool = False, timeout_s: float = 3.0) -> pb.Reply:
        """Take the lease and arm."""

    def move_to(
        self,
        position_m: Vector,
        timeout_s: float = 10.0,
        *,
        settle_s: float = 0.0,
        strict: bool = True,
    ) -> pb.ArmState:
        """Move the tip to a position (3,) in the base frame, m; return the state when it is there.

        It stays there for ``settle_s`` before that. See wait_until_reached.
        """
        target = position_target(position_m)
        state = self.wait_until_reached(target, timeout_s, strict=strict)
        return self.wait(settle_s) if settle_s > 0.0 else state

    def wait_until_reached(
        self, target: pb.Target, timeout_s: float = 10.0, *, strict: bool = True
    ) -> pb.ArmState:
        """Refresh a target until the arm has reached it, and return the state that says so.

        Raises OutOfReach once the arm is as near as it comes; unless ``strict``, that state is
        returned: its ``reach`` tells, ``binding_limits`` why. Raises TargetRejected, ModeRefused
        when the arm stops following, or MoveTimeout.
        """
        self.events()
        for first, state in self._refresh(target, timeout_s):
            if state.target_sequence < first:
                continue
            if state.reach == pb.OUT_OF_REACH and strict:
                raise out_of_reach(state)
            if state.reach in (pb.REACHED, pb.OUT_OF_REACH):
                return state
        raise MoveTimeout(
            f"not reached within {timeout_s:g} s; the arm holds on its way there: give it longer"
        )

    def wait(self, seconds: float) -> pb.ArmState:
        """Stay with the last target for a while, instead of `time.sleep`; return the state then.

        With `time.sleep` the target goes stale and the arm holds, which no camera corrects. An arm
        that is not active is waited with only. Raises TargetRejected, or ModeRefused when the arm
        stops following.
        """
        state = self.state()
        if self._target is None or state.mode != pb.ACTIVE:
            time.sleep(max(0.0, seconds))
            return self.state()
        for _, now in self._refresh(self._target, seconds):
            state = now
        return state

    def hold_at(self, position_m: Vector, seconds: float, timeout_s: float = 10.0) -> pb.ArmState:
        """Move the tip to a position (3,) in the base frame, m, and stay there for a while."""
        return self.move_to(position_m, timeout_s, settle_s=seconds)

    def _refresh(self, target: pb.Target, seconds: float) -> Iterator[tuple[int, pb.ArmState]]:
        """Send a target for a while; yield the first one's number and the newest state."""
        until_s = time.monotonic() + seconds
        self._go_on(self.state(), (*_PAUSES, _HOLD))
        first = self.send(target)
        while time.monotonic() < until_s:
            time.sleep(_REFRESH_S)
            refusal, state = self._refusal(first), self.state()
            if refusal is not None and state.mode == pb.ACTIVE:
                time.sleep(_SHOWN_S)
                state = self.state()
            if state.mode == pb.ACTIVE:
                if refusal is not None:
                    raise refusal
                yield first, state
            else:  # a hold that this very program asks for in the middle of it is meant
                self._go_on(state, _PAUSES)
            self.send(target)

    def _go_on(self, state: pb.ArmState, pauses: Sequence[str]) -> None:
        """Arm again from a hold that is a pause; raise ModeRefused from all else."""
        if state.mode == pb.ACTIVE:
            return
        if self._pauses(state, pauses):
            self.enable()
            return
        mode, past = name_of(pb.Mode, state.mode), self.past_events()
        why = [event.cause or event.text for event in past.latched or of_hold(past.recent)]
        since = f" ({printable(why[0])})" if why else ""
        raise ModeRefused(f"the arm is in mode {mode}{since} and follows no target; enable it")

    def _pauses(self, state: pb.ArmState, pauses: Sequence[str]) -> bool:
        """Whether the arm holds, and may go on without anybody's having to decide it."""
        if state.mode != pb.HOLD or not self._secret:
            return False
        until_s = time.monotonic() + _TOLD_S
        while not (told := of_hold(self.past_events().recent)) and time.monotonic() < until_s:
            time.sleep(_REFRESH_S)
        others = {event.client_id for event in told if event.code == _HOLD} - {self.client_id}
        worse = any(event.level > pb.INFO and event.code not in _NO_MATTER for event in told[1:])
        return bool(told) and told[0].code in pauses and not others and not worse

    def raise_if_refused(self, first: int = 0) -> None:
        """Raise TargetRejected if the daemon has refused a target of this client's.

        Targets before number ``first`` do not count: their refusals may come late.
        """
        refusal = self._refusal(first)
        if refusal is not None:
            raise refusal

    def _refusal(self, first: int) -> TargetRejected | None:
        for event in self.events():
            # A refused request was raised by its own call; its event may come after that.
            ours = event.client_id == self.client_id and event.key == TARGET.key
            if ours and event.code == "rejected" and event.target_sequence >= first:
                return TargetRejected(printable(event.text))
        return None


def of_hold(told: Iterable[pb.Event]) -> list[pb.Event]:
    """Return control's events since the arm holds, the one that began it first.

    ``told`` are the newest events, oldest first. The list is empty where none tells of a hold, or
    its beginning is not among them.
    """
    holding: list[pb.Event] | None = None
    for event in (each for each in told if each.source == "control"):
        if event.mode != pb.HOLD:
            holding = []
        elif holding is not None:
            holding.append(event)
    return holding or []


def out_of_reach(state: pb.ArmState) -> OutOfReach:
    """Make the error of a target that the arm cannot reach, from the state that says so."""
    limits = tuple(name for bit, name in LIMITS.items() if bit & state.binding_limits)
    nearest_m = tuple(state.tip_commanded_position_m)
    shown = ", ".join(f"{1e3 * value:.1f}" for value in nearest_m)
    return OutOfReach(
        f"out of reach: {' and '.join(limits) or 'no limit'} binds; the nearest the arm came is "
        f"({shown}) mm, {1e3 * state.target_error_m:.1f} mm away",
        nearest_m,
        limits,
    )
