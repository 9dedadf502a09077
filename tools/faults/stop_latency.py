"""The stop from a client: from its arrival to the tick that vents, and from end to end."""

import statistics
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import zenoh

from pneuarm.hardware.simulator.parameters import Valves
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import full_key
from pneuarm.service.network.sessions import open_connected
from tools.faults.log_audit import read_session
from tools.faults.rig import Rig


@dataclass
class StopLatency:
    """Times in s: a bare round trip, and from the call to the tick that vents, also in ticks."""

    round_trips_s: list[float] = field(default_factory=list)
    to_tick_s: list[float] = field(default_factory=list)
    ticks: list[int] = field(default_factory=list)
    broken: list[str] = field(default_factory=list)

    def text(self) -> str:
        """One sentence with the medians."""
        trip = 1e3 * statistics.median(self.round_trips_s)
        stop = 1e3 * statistics.median(self.to_tick_s)
        counted = ", ".join(
            f"{self.ticks.count(n)} times in tick {n}" for n in sorted(set(self.ticks))
        )
        return (
            f"The stop of a client, {len(self.to_tick_s)} times: {stop:.2f} ms from the call to "
            f"the tick that vents (median; worst {1e3 * max(self.to_tick_s):.2f} ms); counted from "
            f"the call it acted {counted}. A bare Zenoh round trip between two clients through the "
            f"same router in the same run, which is four hops: {trip:.2f} ms (median; worst "
            f"{1e3 * max(self.round_trips_s):.2f} ms)."
        )

    def json(self) -> dict[str, Any]:
        """The same for programs."""
        return {
            "round_trips_s": self.round_trips_s,
            "to_tick_s": self.to_tick_s,
            "ticks": self.ticks,
        }


def measure_stop(times: int, valves: Valves) -> StopLatency:
    """Stop a ready arm again and again; in between a ball goes to and fro over the router."""
    found = StopLatency()
    with Rig({}, valves=valves) as rig:
        ball = Ball(rig)
        calls_ns = []
        for _ in range(times):
            found.round_trips_s.append(ball.throw())
            time.sleep(0.01)
            calls_ns.append(time.monotonic_ns())
            rig.watcher.estop()
            rig.watcher.reset()
            rig.wait_for_mode(pb.READY)
        ball.close()
        rig.end_programs()
        rig.daemon.stop()
        session = read_session(rig.daemon.log_path(), rig.offset_ns)
    for call_ns in calls_ns:
        later = session.time_ns >= call_ns
        at = np.flatnonzero(later & (session.mode == pb.ESTOP))
        if len(at):
            found.ticks.append(int(later[: at[0] + 1].sum()))
            found.to_tick_s.append(float(session.time_ns[at[0]] - call_ns) * 1e-9)
        else:
            found.broken.append("the stop: no tick shows it")
    return found


class Ball:
    """Two sessions of the kind that clients have, and a message between them."""

    def __init__(self, rig: Rig) -> None:
        self._here, self._there = (open_connected(rig.daemon.endpoint) for _ in range(2))
        to, fro = (full_key(rig.daemon.arm, f"ball/{way}") for way in ("to", "fro"))
        urgent: dict[str, Any] = {
            "priority": zenoh.Priority.REAL_TIME,
            "congestion_control": zenoh.CongestionControl.BLOCK,
            "express": True,
        }
        back = self._there.declare_publisher(fro, **urgent)
        self._to = self._here.declare_publisher(to, **urgent)
        self._partner = self._there.declare_subscriber(to, lambda sample: back.put(b"ball"))
        self._from = self._here.declare_subscriber(fro)
        time.sleep(0.3)  # until both know of each other

    def throw(self) -> float:
        """Return the time until it is back, s."""
        begin = time.monotonic()
        self._to.put(b"ball")
        self._from.recv()
        return time.monotonic() - begin

    def close(self) -> None:
        """End both sessions."""
        self._here.close()
        self._there.close()
