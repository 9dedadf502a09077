"""A recorded session over Zenoh: everything that a daemon publishes, with its timing."""

import time

import zenoh

from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.reading.replay import paced
from pneuarm.logs.schema.codec import encoding_of
from pneuarm.logs.schema.topics import ALIVE_DAEMON, TOPICS, full_key
from pneuarm.service.network import sessions as network
from pneuarm.service.replay.telling import say, say_damage

_OUT = tuple(topic for topic in TOPICS if topic.direction == "out")


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
        token = session.liveliness().declare_token(full_key(arm, ALIVE_DAEMON))
        print(f"replaying {reader.parts[0]} at speed {speed:g} on {listen}", flush=True)
        shown_ns: dict[str, int] = {}
        for entry in paced(reader, speed, loop, time.monotonic, time.sleep, say):
            topic = entry.topic
            if topic not in _OUT:
                continue
            if topic.rate_hz is not None:  # the file has every tick, the wire has not
                since_ns = entry.time_unix_ns - shown_ns.get(topic.key, 0)
                if 0 <= since_ns < 0.9e9 / topic.rate_hz:  # below 0 the log begins again
                    continue
                shown_ns[topic.key] = entry.time_unix_ns
            message = entry.message
            publishers[topic.key].put(message.SerializeToString(), encoding=encoding_of(message))
        say_damage(reader)
        token.undeclare()
    finally:
        session.close()
    return 0
