"""What the gateway publishes: state, tip, tf and health at their rates, events as they come."""

from collections.abc import Iterator
from typing import cast

import numpy as np
import zenoh
from google.protobuf.message import Message

from pneuarm.controllers.arm.arm import Arm
from pneuarm.logs.foxglove.frames import frame_transforms, tip_pose
from pneuarm.logs.rings.ring import RingReader
from pneuarm.logs.rings.rings import MessageReader
from pneuarm.logs.rings.tick import state_from_tick, tick_dtype
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.codec import encoding_of
from pneuarm.logs.schema.topics import (
    EVENT,
    EVENTS,
    HEALTH,
    STATE,
    TF,
    TIP,
    TOPICS,
    Topic,
    full_key,
)
from pneuarm.service.processes.shared import Shared
from pneuarm.service.processes.usage import ProcessUsage
from pneuarm.service.wire.answers import Answer
from pneuarm.service.wire.event_history import EventHistory

_HEALTH_S = 1.0
#: What the newest message of also answers queries.
_LATEST = tuple(topic for topic in TOPICS if topic.newest)


class Publisher:
    """Reads the rings and publishes; a subscriber that stalls is dropped, never waited for."""

    #: Keys that are answered by :meth:`on_latest`.
    queried = (*_LATEST, EVENTS)

    def __init__(self, shared: Shared, arm: Arm, session: zenoh.Session) -> None:
        self._shared, self._session, self._arm = shared, session, arm
        self._dtype = tick_dtype(arm.n_sections)
        self._ticks = RingReader(shared.rings.ticks)
        self._ticks.skip_to(self._ticks.head())
        self._events = MessageReader(shared.rings.messages())
        self._publishers = {
            topic.key: session.declare_publisher(
                full_key(arm.name, topic.key),
                congestion_control=zenoh.CongestionControl.DROP,
            )
            for topic in (*_LATEST, EVENT)
        }
        self._history = EventHistory()
        self._latest = {EVENTS.key: Answer(self._history.message())}
        self._since_health: list[bytes] = []
        self._health_at_s = 0.0
        self._usage = ProcessUsage(shared.processes)
        self.newest_sequence = 0
        self.newest_mode: pb.Mode = pb.IDLE

    def on_latest(self, topic: Topic, query: zenoh.Query) -> None:
        """Answer with the newest message of a key; without one, there is no answer."""
        newest = self._latest.get(topic.key)
        if newest is None:
            query.drop()
        else:
            newest.give(query, full_key(self._arm.name, topic.key))

    def _publish(self, topic: Topic, message: Message) -> None:
        self._latest[topic.key] = Answer(message)
        self._publishers[topic.key].put(message.SerializeToString(), encoding=encoding_of(message))

    def step(
        self, now_s: float, rejected: int, command_drops: int, lease_holder: str
    ) -> Iterator[pb.Health]:
        """Publish what is new; yield a Health when one was due, to be logged."""
        records = self._ticks.read(4096)
        if records:
            self.newest_sequence, newest = records[-1]
            self._publish_tick(np.frombuffer(newest, self._dtype)[0])
            self._since_health.extend(record for _, record in records)
        for topic, payload, _ in self._events.read():
            if topic is EVENT:
                event = pb.Event.FromString(payload)
                self._publish(EVENT, event)
                self._history.add(event)
                self._latest[EVENTS.key] = Answer(self._history.message())
        if now_s - self._health_at_s >= _HEALTH_S and self._since_health:
            health = self._health(now_s)
            health.rejected_messages, health.command_drops = rejected, command_drops
            health.lease_holder = lease_holder
            self._publish(HEALTH, health)
            yield health

    def _publish_tick(self, tick: np.void) -> None:
        self.newest_mode = cast("pb.Mode", int(tick["mode"]))
        self._publish(STATE, state_from_tick(tick))
        self._publish(TIP, tip_pose(tick))
        self._publish(TF, frame_transforms(tick))

    def _health(self, now_s: float) -> pb.Health:
        ticks = np.frombuffer(b"".join(self._since_health), self._dtype)
        self._since_health.clear()
        self._health_at_s = now_s
        span_s = (ticks["time_unix_ns"][-1] - ticks["time_unix_ns"][0]) * 1e-9
        return pb.Health(
            time_unix_ns=int(ticks["time_unix_ns"][-1]),
            ticks=int(ticks["sequence"][-1]),
            rate_hz=(len(ticks) - 1) / span_s if span_s > 0 else 0.0,
            wake_us=latency_us(ticks["wake_latency_s"]),
            compute_us=latency_us(ticks["compute_s"]),
            overruns=int(ticks["overruns"][-1]),
            disk_free_bytes=self._shared.recorder.free_bytes,
            processes=self._usage.read(now_s, self._dropped()),
        )

    def _dropped(self) -> dict[str, int]:
        return {
            "viewer": self._shared.viewer.skipped,
            "recorder": self._shared.recorder.missed,
            "gateway": self._ticks.missed,
        }


def latency_us(seconds: np.ndarray) -> pb.Latency:
    """Median, 99th percentile and maximum, in microseconds."""
    p50, p99 = np.percentile(seconds, (50, 99)) * 1e6
    return pb.Latency(p50=p50, p99=p99, max=float(seconds.max()) * 1e6)
