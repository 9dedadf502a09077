"""A camera lies: the arm goes on, it moves no further than the bound, and few events tell it."""

import math
import time
from collections.abc import Callable

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.control.once import Once
from tools.faults.fault import Fault
from tools.faults.injection import Injection
from tools.faults.program import Program
from tools.faults.rig import Rig
from tools.rig.daemon import enough

#: Quarter of the arm's 200 mm, and what the arm itself misses while it moves.
_FARTHEST_M = 0.05 + 0.04

#: So many events may come of one lie.
_MOST_EVENTS = 12


def _camera(rig: Rig, name: str = "camera") -> Program:
    return rig.beside(name, "tools.faults.liar")


def _lies(*words: str, code: str = "") -> Callable[[Rig, Injection], None]:
    def inject(rig: Rig, injection: Injection) -> None:
        camera = _camera(rig)
        camera.ask("see 100", "does")
        rig.wait_until(enough(1.0), "an honest camera")
        rig.move()
        rig.watcher.events()
        injection.begin()
        for word in words:
            camera.ask(word, "does")
        rig.wait_until(enough(injection.random.uniform(2.5, 4.0)), "lies")
        state = rig.watcher.state()
        injection.must_go_on()
        events = rig.watcher.events()
        camera.ask("blind", "does")
        off_m = math.dist(state.tip_true_position_m, state.reference_position_m or (math.inf,) * 3)
        injection.figures["tip_off_mm"] = 1e3 * off_m
        injection.check("the tip stays near", off_m < _FARTHEST_M, f"{1e3 * off_m:.0f} mm off")
        told = [event.code for event in events]
        injection.check("no flood of events", len(told) <= _MOST_EVENTS, f"{len(told)} events")
        if code:
            # What comes again within some seconds is counted and told later.
            injection.check(
                f"{code} is told",
                code in told or code in _told_before(rig),
                ", ".join(sorted(set(told))),
            )

    return inject


def _told_before(rig: Rig) -> set[str]:
    """Codes that the log has of the time in which a repeated event is only counted."""
    since_ns = time.time_ns() - int(2e9 * Once.EVERY_S)
    return {event.code for event in rig.daemon.events() if event.time_unix_ns > since_ns}


def _far(rig: Rig, injection: Injection) -> None:
    """It says the tip is where no model has it: the arm holds, until an honest camera is back."""
    camera = _camera(rig)
    camera.ask("see 100", "does")
    rig.wait_until(enough(1.0), "an honest camera")
    rig.move()
    injection.must_reach(pb.HOLD, within_s=1.5)
    injection.begin()
    camera.ask("lie far", "does")
    rig.wait_for_mode(pb.HOLD)
    camera.ask("honest", "does")
    rig.wait_until(enough(0.5), "an honest camera again")
    camera.ask("blind", "does")


def _second(rig: Rig, injection: Injection) -> None:
    """Another publisher, under another name, says the tip is elsewhere."""
    camera, other = _camera(rig), _camera(rig, "stranger")
    camera.ask("see 100", "does")
    rig.wait_until(enough(1.0), "an honest camera")
    rig.move()
    injection.begin()
    other.ask("lie drift", "does")
    rig.wait_until(enough(2.0), "a second publisher")
    injection.must_go_on()
    offset_m = math.hypot(*rig.watcher.state().tip_offset_m)
    injection.check("it moves nothing", offset_m < _FARTHEST_M, f"{1e3 * offset_m:.0f} mm")
    for program in (camera, other):
        program.ask("blind", "does")


_GOES_ON = "goes on; the correction is held or bounded, and it is told"


def _row(name: str, *words: str, code: str = "") -> Fault:
    return Fault(f"camera: {name}", _GOES_ON, _lies(*words, code=code))


FAULTS = (
    _row("frozen", "lie freeze", code="tip_pose_not_along"),
    _row("jumps to and fro", "lie jump", code="tip_pose_refused"),
    _row("drifts, 20 mm/s", "lie drift"),
    _row("axes flipped", "lie flip"),
    _row("marker turned over", "lie turn", code="correction_limited"),
    _row("late", "lie late"),
    _row("5 Hz", "see 5", code="camera_lost"),
    Fault("camera: 0.3 m away", "holds: `model_contradicted`", _far),
    Fault("camera: a second publisher", "goes on, refused", _second),
)
