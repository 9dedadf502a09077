"""The motion of a calibration, sent by a client, and the states that come back.

What interrupts it (a hold, a fault, a stall, a tip out of sight) ends no calibration: the arm holds
or is vented, the reason is told, and on the operator's word it is armed again, repeats the move it
was in, and goes on. What was moved until then is kept for a later session.
"""

import contextlib
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import (
    CalibrationError,
    LeaseRefused,
    ModeRefused,
    PneuarmError,
)
from pneuarm.controllers.calibration.pace import Pace
from pneuarm.controllers.calibration.plan import KNOWN, Move, duration_s
from pneuarm.controllers.calibration.recording import Recording, fresh_tips, joined
from pneuarm.logs.rings.tick import ticks_from_states
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.printable import name_of
from pneuarm.service.calibration.motion import Pacer
from pneuarm.service.calibration.recordings import recording_of
from pneuarm.service.client.client import Client
from pneuarm.service.configuration.configuration import Configuration

_REFRESH_S = 0.02
_POLL_S = 0.002
#: A tip pose older than this (s) means that nobody measures now.
_LOST_S = 1.0
#: Whether an arm has settled is looked at this often (s).
_LOOK_S = 0.1
#: More states than tell whether an arm has settled.
_TAIL = 500
#: A move that is repeated is approached in this time (s), from wherever the arm holds.
_AGAIN_S = 2.0
#: An arm that is armed this far (Pa) from where the plan has it is elsewhere.
_HELD_PA = 3000.0

Progress = Callable[[float, float], None]
#: Asked whether to arm again, told why the arm stopped; False ends the motion.
Word = Callable[[str], bool]


def require_tip(client: Client) -> None:
    """Raise CalibrationError where no tip pose arrives at the daemon."""
    if not is_measured(client.state()):
        raise CalibrationError(not_measured(client.arm, "a calibration"))


def not_measured(arm: str, what: str) -> str:
    """Say what to do where no tip pose arrives, and ``what`` needs one."""
    return (
        f"the tip of arm {arm!r} is not measured: {what} needs its pose on "
        f"pneuarm/{arm}/sensor/tip_pose; start the motion capture, or `pneuarm emulate camera` "
        "beside a simulated arm"
    )


def is_measured(state: pb.ArmState) -> bool:
    """Whether the tip is measured now."""
    return len(state.tip_measured_position_m) == 3 and state.tip_measured_age_s < _LOST_S


@dataclass
class Progressed:
    """How far a motion has come: moves that are done, and what was recorded of all of them."""

    moves_done: int = 0
    pieces: list[Recording] = field(default_factory=list)

    @property
    def recording(self) -> Recording:
        """Everything, one piece after the other."""
        return joined(self.pieces)


def record(
    client: Client,
    moves: Sequence[Move],
    configuration: Configuration,
    tell: Progress,
    word: Word = lambda why: False,
    so_far: Progressed | None = None,
    pace: Pace = KNOWN,
) -> Recording:
    """Arm, go through the moves that are not done, vent; return what was recorded on the way.

    ``so_far`` is what was done before, and is kept up to date whatever happens. ``pace`` is that at
    which a move is approached that did not begin where the plan has it. An interruption is
    told to ``word``, which says whether to arm again; where it does not, its error is raised.
    Whatever ends it early, Ctrl-C too, leaves the arm holding, then vented.
    """
    so_far = so_far or Progressed()
    client.enable()
    try:
        while so_far.moves_done < len(moves):
            try:
                _go_on(client, moves, configuration, tell, so_far, pace)
            except (ModeRefused, CalibrationError) as error:
                _again(client, error, word)
    finally:
        with contextlib.suppress(PneuarmError):
            client.hold()
            client.vent()
    return so_far.recording


def _again(client: Client, error: PneuarmError, word: Word) -> None:
    """Hold, ask, and arm again; raises the error where the word is not given."""
    with contextlib.suppress(PneuarmError):
        client.hold()
    if isinstance(error, LeaseRefused) or not word(str(error)):
        raise error
    while True:
        try:
            if client.state().mode in (pb.FAULT, pb.ESTOP):
                client.reset()
            client.enable()
            require_tip(client)
        except (ModeRefused, CalibrationError) as still:
            if isinstance(still, LeaseRefused) or not word(str(still)):
                raise
            continue
        return


def _go_on(
    client: Client,
    moves: Sequence[Move],
    configuration: Configuration,
    tell: Progress,
    so_far: Progressed,
    pace: Pace,
) -> None:
    """Go through the moves that are left; what was recorded is kept, however it ends."""
    states, pacer = [client.state()], Pacer(configuration)
    n_sections = len(configuration.arm.sections)
    start = np.array(states[0].pressure_sent_pa).reshape(n_sections, 3)
    client.events()
    whole_s = duration_s(list(moves))
    first = so_far.moves_done
    planned = moves[first - 1].pressures_pa if first else np.zeros_like(start)
    elsewhere = bool(np.abs(start - planned).max() > _HELD_PA)
    try:
        for number in range(first, len(moves)):
            move = moves[number]
            if number == first and elsewhere:  # no step from there, and no ramp that is too fast
                again_s = max(_AGAIN_S, pace.ramp_s(move.pressures_pa - start))
                move = replace(move, ramp_s=max(move.ramp_s, again_s))
            done_s = duration_s(list(moves[:number]))
            pacer.begin(move)
            _follow(client, move, start, states, pacer, partial(_tell_on, tell, done_s, whole_s))
            start, so_far.moves_done = move.pressures_pa, number + 1
    finally:
        if len(states) > 1:
            so_far.pieces.append(recording_of(ticks_from_states(states, n_sections)))


def _tell_on(tell: Progress, done_s: float, whole_s: float, elapsed_s: float) -> None:
    tell(done_s + elapsed_s, whole_s)


def _follow(
    client: Client,
    move: Move,
    start: Array,
    states: list[pb.ArmState],
    pacer: Pacer,
    tell: Callable[[float], None],
) -> None:
    """Send one move until it is over; its states are appended."""
    before_s = sent_s = looked_s = time.monotonic()
    while True:
        now_s = time.monotonic()
        pacer.go_on(now_s - before_s)
        before_s, elapsed_s = now_s, pacer.elapsed_s
        if now_s >= looked_s:
            if move.over(elapsed_s, partial(_newest, states)):
                return
            looked_s = now_s + _LOOK_S
        if now_s >= sent_s:
            # A target that is refused goes stale, and the arm holds: its event says why.
            client.send_pressures(move.at(start, elapsed_s).reshape(-1).tolist())
            sent_s = now_s + _REFRESH_S
        state = client.state()
        if state.sequence != states[-1].sequence:
            _require_going_on(client, state)
            states.append(state)
            seen_s = 1e-9 * (state.time_unix_ns - states[0].time_unix_ns)
            pacer.see(seen_s, [*state.pressure_sent_pa], [*state.pressure_measured_pa])
        tell(min(elapsed_s, move.duration_s))
        time.sleep(_POLL_S)


def _newest(states: list[pb.ArmState], seconds: float) -> tuple[Array, Array, Array]:
    """Times, measured pressures and measured tips of the newest states."""
    ends_ns = states[-1].time_unix_ns - int(1.05e9 * seconds)
    tail = [state for state in states[-_TAIL:] if state.time_unix_ns > ends_ns]
    ticks = ticks_from_states(tail, tail[-1].n_sections)
    time_s = (ticks["time_unix_ns"] - ticks["time_unix_ns"][0]) * 1e-9
    tips = fresh_tips(ticks["tip_measured_position_m"], ticks["tip_measured_age_s"])
    return time_s, ticks["pressure_measured_pa"], tips


def _require_going_on(client: Client, state: pb.ArmState) -> None:
    if state.mode != pb.ACTIVE:
        raise ModeRefused(left_active(client, state, "the calibration"))
    if not is_measured(state):
        raise CalibrationError(
            "the tip was not measured any more in the middle of the calibration: see that the "
            "marker stays in view"
        )


def left_active(client: Client, state: pb.ArmState, what: str) -> str:
    """Say that the arm has left active in the middle of something, and why."""
    mode = name_of(pb.Mode, state.mode)
    return f"the arm went to mode {mode} in the middle of {what}{_cause(client, state.mode)}"


def _cause(client: Client, mode: "pb.Mode") -> str:
    """Return what the daemon said of the change of mode, in brackets: fault, cause and remedy."""
    time.sleep(0.1)  # an event may come after the state that shows its effect
    told = client.events()
    if not told:
        return ""
    # The first of the gravest among those of that mode: what changed it.
    event = max(told, key=lambda event: (event.mode == mode, event.level))
    said = "; ".join(part for part in (event.text, event.cause, event.remedy) if part)
    return f" ({event.code}: {said})"


def ask(why: str) -> bool:
    """Tell the operator why the arm stopped, and wait for the word; nobody there is a no."""
    print(f"\ncalibrate: {why}", file=sys.stderr)
    print(
        "press Enter to arm again, repeat this move and go on; Ctrl-C ends it here",
        file=sys.stderr,
        flush=True,
    )
    return sys.stdin.readline() != ""


def progress() -> Progress:
    """Return what shows how far it is: a bar on a terminal, else a line every tenth."""
    shown = -1

    def tell(elapsed_s: float, whole_s: float) -> None:
        nonlocal shown
        on_terminal = sys.stderr.isatty()
        steps = 200 if on_terminal else 10
        step = min(steps, int(steps * elapsed_s / whole_s + 1e-9))
        if step == shown:
            return
        shown = step
        left = f"{max(0.0, whole_s - elapsed_s):.0f} s left"
        if on_terminal:
            bar = "#" * round(30 * step / steps)
            end = "\n" if step == steps else ""
            print(f"\rcalibrating [{bar:30}] {left:12}", end=end, file=sys.stderr, flush=True)
        else:
            print(f"calibrating: {100 * step // steps} %, {left}", file=sys.stderr, flush=True)

    return tell
