"""Garbage on the wire: it changes nothing; anything at all on the stop's key stops."""

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import full_key
from tools.faults.fault import Fault
from tools.faults.injection import Injection
from tools.faults.rig import Rig

#: In one injection; thirty of them are more than the hundred thousand.
PAYLOADS = 3_400

#: Pools breathe by so much; 3400 payloads that leave 3 kB each behind are more.
_GROWTH_BYTES = 8 * 2**20


def _garbage(rig: Rig, injection: Injection) -> None:
    if not rig.has_beside("fuzz"):  # the first garbage fills Zenoh's and Python's own pools
        rig.beside("fuzz", "tools.faults.fuzz").ask(f"-1 {PAYLOADS}", "sent")
        rig.move()
    fuzzer = rig.beside("fuzz", "tools.faults.fuzz")
    rejected, gateway = rig.health().rejected_messages, rig.pid("gateway")
    before = rig.memory_bytes("gateway")
    injection.begin()
    fuzzer.tell(f"{injection.seed} {PAYLOADS}")
    injection.figures["payloads_number"] = float(fuzzer.hear("sent"))
    injection.must_go_on()
    rig.move()
    injection.check("the gateway lives", rig.pid("gateway") == gateway)
    grown = rig.memory_bytes("gateway") - before
    injection.figures["gateway_grown_bytes"] = grown
    injection.check(
        "the gateway's memory", grown < _GROWTH_BYTES, f"grew by {grown / 2**20:.0f} MiB"
    )
    found = rig.health().rejected_messages - rejected
    injection.check("garbage is refused and counted", found > 0.5 * PAYLOADS, f"only {found}")
    injection.only_targets_of = "mover"


def _anything_stops(rig: Rig, injection: Injection) -> None:
    payload = injection.random.randbytes(injection.random.choice((0, 1, 100, 70_000)))
    encoding = injection.random.choice(("", "application/json", "application/protobuf;x"))
    injection.must_reach(pb.ESTOP, within_s=0.1)
    key = full_key(rig.daemon.arm, "cmd/estop")
    injection.begin()
    rig.watcher._session.put(key, payload, encoding=encoding)
    rig.wait_for_mode(pb.ESTOP)
    rig.watcher.reset()


FAULTS = (
    Fault("garbage on every key", "goes on, refused; memory unchanged", _garbage),
    Fault("anything on the stop's key", "stops", _anything_stops),
)
