"""A recorded session over Zenoh: states, tip, tf, health and events with their timing."""

import time

import zenoh

from logs.codec import encoding_of
from logs.reader import LogReader
from logs.replay import paced
from logs.topics import ALIVE_DAEMON, EVENT, HEALTH, STATE, TF, TIP, full_key
from service import network

_OUT = (STATE, TIP, TF, HEALTH, EVENT)


def replay_over_zenoh(reader: LogReader, speed: float, loop: bool, listen: str) -> int:
    """Publish the log as the daemon would have; no command key is listened to."""
    network.check_free("--listen", listen)
    session = network.open_listening([listen], "")
    arm = reader.info.arm
    try:
        publishers = {
            topic.key: session.declare_publisher(
                full_key(arm, topic.key), congestion_control=zenoh.CongestionControl.DROP
            )
            for topic in _OUT
        }
        session.liveliness().declare_token(full_key(arm, ALIVE_DAEMON))
        print(f"replaying {reader.parts[0]} at speed {speed:g} on {listen}", flush=True)
        next_ns: dict[str, int] = {}
        for entry in paced(reader, speed, loop, time.monotonic, time.sleep):
            topic = entry.topic
            if topic not in _OUT or entry.time_unix_ns < next_ns.get(topic.key, 0):
                continue
            if topic.rate_hz is not None:  # the file has every tick, the wire has not
                next_ns[topic.key] = entry.time_unix_ns + int(0.9e9 / topic.rate_hz)
            message = entry.message
            publishers[topic.key].put(message.SerializeToString(), encoding=encoding_of(message))
    finally:
        session.close()
    return 0
