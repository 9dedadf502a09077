"""The motion of a calibration, sent by a client, and the states that come back."""

import contextlib
import sys
import time
from collections.abc import Callable, Sequence

import numpy as np

from pneuarm.controllers.arm.errors import CalibrationError, ModeRefused, PneuarmError
from pneuarm.controllers.calibration.plan import Move, duration_s
from pneuarm.controllers.calibration.recording import Recording
from pneuarm.logs.rings.tick import ticks_from_states
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.printable import name_of
from pneuarm.service.calibration.recordings import recording_of
from pneuarm.service.client.client import Client

_REFRESH_S = 0.02
_POLL_S = 0.002
#: A tip pose older than this (s) means that nobody measures now.
_LOST_S = 1.0

Progress = Callable[[float, float], None]


def require_tip(client: Client) -> None:
    """Raise CalibrationError where no tip pose arrives at the daemon."""
    if not _measured(client.state()):
        raise CalibrationError(
            f"the tip of arm {client.arm!r} is not measured: a calibration needs its pose on "
            f"pneuarm/{client.arm}/sensor/tip_pose; start the motion capture, or `pneuarm emulate "
            "camera` beside a simulated arm"
        )


def _measured(state: pb.ArmState) -> bool:
    return len(state.tip_measured_position_m) == 3 and state.tip_measured_age_s < _LOST_S


def record(client: Client, moves: Sequence[Move], n_sections: int, tell: Progress) -> Recording:
    """Arm, go through the moves, vent; return what was recorded on the way.

    Whatever ends it early, Ctrl-C too, leaves the arm holding, then vented. Raises ModeRefused
    when the arm stops following, and CalibrationError when the tip is no longer measured.
    """
    client.enable()
    try:
        states = _moved(client, moves, n_sections, tell)
    finally:
        with contextlib.suppress(PneuarmError):
            client.hold()
            client.vent()
    return recording_of(ticks_from_states(states, n_sections))


def _moved(
    client: Client, moves: Sequence[Move], n_sections: int, tell: Progress
) -> list[pb.ArmState]:
    states = [client.state()]
    whole_s, start = duration_s(list(moves)), np.zeros((n_sections, 3))
    began_s = move_s = sent_s = time.monotonic()
    client.events()
    for move in moves:
        while (now_s := time.monotonic()) < move_s + move.duration_s:
            if now_s >= sent_s:
                pressures = move.at(start, now_s - move_s)
                client.send_pressures(pressures.reshape(-1).tolist())
                client.raise_if_refused()
                sent_s = now_s + _REFRESH_S
            state = client.state()
            if state.sequence != states[-1].sequence:
                _require_going_on(state)
                states.append(state)
            tell(now_s - began_s, whole_s)
            time.sleep(_POLL_S)
        start, move_s = move.pressures_pa, move_s + move.duration_s
    return states


def _require_going_on(state: pb.ArmState) -> None:
    if state.mode != pb.ACTIVE:
        mode = name_of(pb.Mode, state.mode)
        raise ModeRefused(
            f"the arm went to mode {mode} in the middle of the calibration; nothing was written"
        )
    if not _measured(state):
        raise CalibrationError(
            "the tip was not measured any more in the middle of the calibration; nothing was "
            "written: see that the marker stays in view, and calibrate again"
        )


def progress() -> Progress:
    """Return what shows how far it is: a bar on a terminal, else a line every tenth."""
    shown = -1

    def tell(elapsed_s: float, whole_s: float) -> None:
        nonlocal shown
        on_terminal = sys.stderr.isatty()
        steps = 200 if on_terminal else 10
        step = min(steps, int(steps * elapsed_s / whole_s))
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
