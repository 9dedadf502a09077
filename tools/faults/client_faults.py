"""Clients die, freeze, flood, fight, and send what is no target."""

import signal
import time

from pneuarm.logs.schema import pneuarm_pb2 as pb
from tools.faults.fault import Fault
from tools.faults.injection import Injection
from tools.faults.rig import TABLES, Rig
from tools.rig.daemon import enough

_TIMEOUT_S = TABLES["control"]["target_timeout_ms"] * 1e-3

#: Beyond the timeout: one tick, and what the last target was late when the fault happened.
_HOLDS_S = _TIMEOUT_S + 0.05

#: A moving arm's setpoints are ahead of its pressures; a hold takes that off within the slew limit.
_LEAD_S = 0.1


def _killed(rig: Rig, injection: Injection) -> None:
    injection.must_reach(pb.HOLD, within_s=_HOLDS_S)
    injection.begin()
    rig.mover.process.kill()
    rig.wait_for_mode(pb.HOLD)
    rig.replace_mover()


def _frozen(rig: Rig, injection: Injection) -> None:
    injection.must_reach(pb.HOLD, within_s=_HOLDS_S)
    injection.held_after_s = _TIMEOUT_S
    injection.begin()
    rig.mover.process.send_signal(signal.SIGSTOP)
    try:
        rig.wait_for_mode(pb.HOLD)
        time.sleep(_LEAD_S)
        held = list(rig.watcher.state().pressure_sent_pa)
    finally:
        rig.mover.process.send_signal(signal.SIGCONT)
    rig.wait_until(enough(0.2), "what it sends when it wakes")
    state = rig.watcher.state()
    injection.check("nothing it sends then moves the arm", state.mode == pb.HOLD)
    injection.check("hold keeps the pressures", list(state.pressure_sent_pa) == held)


def _flood(rig: Rig, injection: Injection) -> None:
    """Half of the floods come from who holds the arm, half from who does not."""
    stranger = injection.random.random() < 0.5
    flooder = rig.beside("flooder") if stranger else rig.mover
    before = rig.memory_bytes("gateway")
    flooder.tell("flood 0.8")
    time.sleep(injection.random.uniform(0.2, 0.6))
    injection.must_reach(pb.ESTOP, within_s=0.5)
    injection.begin()
    rig.watcher.estop()
    injection.figures["messages_hz"] = float(flooder.hear("flooded"))
    grown = rig.memory_bytes("gateway") - before
    injection.figures["gateway_grown_bytes"] = grown
    rig.watcher.reset()


def _fight(rig: Rig, injection: Injection) -> None:
    other = rig.beside("fighter")
    rig.watcher.events()
    injection.begin()
    for program in (rig.mover, other):
        program.tell(f"fight 1.0 {injection.random.randrange(2**31)}")
    taken = [int(program.hear("fought")) for program in (rig.mover, other)]
    injection.check("both had the arm", min(taken) > 0, str(taken))
    injection.must_stay(pb.ACTIVE, pb.HOLD)
    rig.wait_for_mode(pb.HOLD)
    holds = [e for e in rig.watcher.events() if e.code in ("lease_lost", "target_stale")]
    injection.check("every take-over holds first", len(holds) >= 2, f"{len(holds)} holds")


def _bad_targets(rig: Rig, injection: Injection) -> None:
    rejected = rig.health().rejected_messages
    injection.begin()
    rig.mover.ask("bad", "moves")
    rig.wait_until(enough(1.2), "bad targets")
    injection.must_go_on()
    rig.mover.ask("go", "moves")
    found = rig.wait_until(lambda: rig.health().rejected_messages - rejected, "rejections", 3.0)
    injection.check("they are refused and counted", found > 20, f"only {found}")


FAULTS = (
    Fault("client killed", "holds within the target's timeout", _killed),
    Fault("client frozen", "holds within the target's timeout, and stays", _frozen),
    Fault("client floods, 10 kHz", "goes on or holds; the stop acts", _flood),
    Fault("two clients fight", "holds at every take-over", _fight),
    Fault("targets not a number, far, old, short", "goes on, refused", _bad_targets),
)
