"""Garbage on every key, from a process of its own.

    python -m tools.faults.fuzz ARM ENDPOINT

A line `SEED N` in sends N payloads; a line out says how many went. Random bytes, mutated valid
messages, JSON good and bad, and wrong encodings go to every key that the daemon takes: targets,
poses, mode requests, and the queries. A payload that happens to be a good request of anybody's
(hold, vent, reset, a take-over) is no garbage, and goes to another key. Stops are another fault:
anything at all on their key stops the arm.
"""

import json
import random
import sys
import threading

import zenoh
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from google.protobuf import json_format
from google.protobuf.message import Message

from pneuarm.controllers.arm.errors import MessageRejected
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.codec import JSON, PROTOBUF, decode
from pneuarm.logs.schema.topics import full_key
from pneuarm.service.client.target_messages import pose_target, position_target, twist_target
from pneuarm.service.network import sessions as network

_ENCODINGS = (PROTOBUF, JSON, "text/json", f"{PROTOBUF};pneuarm.Target", f"{PROTOBUF};x", "", "zz")
_SIZES = (0, 1, 2, 7, 30, 200, 2000, 65536, 65537)


def _messages() -> list[Message]:
    targets = [
        position_target((0.02, 0.0, 0.2)),
        pose_target((0.0, 0.01, 0.21), (0.0, 0.0, 0.0, 1.0)),
        twist_target((0.01, 0.0, 0.0), (0.0, 0.1, 0.0), "base", "tip"),
        pb.Target(lengths=pb.LengthsTarget(length_m=[0.2, 0.21, 0.19])),
        pb.Target(pressures=pb.PressuresTarget(pressure_pa=[1e4, -1e4, 0.0])),
    ]
    for number, target in enumerate(targets):
        target.client_id, target.lease_secret = "fuzz", "0123456789abcdef"
        target.sequence, target.state_sequence = number + 1, 5000
    request = pb.ModeRequest(client_id="fuzz", action=pb.ENABLE, lease_secret="0123456789abcdef")
    pose = PoseInFrame(frame_id="base")
    pose.pose.position.z = 0.2
    return [*targets, request, pose, pb.Health(ticks=7), pb.Reply(accepted=True)]


class Garbage:
    """Payloads with their encodings, from a seed."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)
        self._bytes = [message.SerializeToString() for message in _messages()]
        self._texts = [json_format.MessageToJson(message, indent=None) for message in _messages()]

    def payload(self) -> tuple[bytes, str]:
        """Return one, with the encoding that it claims."""
        rng = self._random
        kind = rng.randrange(5)
        if kind == 0:
            return rng.randbytes(rng.choice(_SIZES)), rng.choice(_ENCODINGS)
        if kind == 1:
            return self._mutated(rng.choice(self._bytes)), PROTOBUF
        if kind == 2:
            return self._mutated(rng.choice(self._texts).encode()), JSON
        if kind == 3:
            return json.dumps(self._wild(4)).encode("utf-8", "surrogatepass"), JSON
        return rng.choice(self._bytes), rng.choice(_ENCODINGS)

    def _mutated(self, data: bytes) -> bytes:
        """Flip, cut, double or insert a few bytes."""
        rng, found = self._random, bytearray(data)
        for _ in range(rng.randint(1, 6)):
            at = rng.randrange(len(found)) if found else 0
            match rng.randrange(4):
                case 0 if found:
                    found[at] ^= 1 << rng.randrange(8)
                case 1:
                    del found[at : at + rng.randint(1, 8)]
                case 2:
                    found[at:at] = rng.randbytes(rng.randint(1, 8))
                case 3:
                    found[at:at] = found[at : at + rng.randint(1, 16)]
        return bytes(found)

    def _wild(self, depth: int) -> object:
        """Return any value JSON can hold, under names that mean something here."""
        rng = self._random
        names = ("position", "position_m", "x", "action", "lengths", "length_m", "law", "frame_id")
        leaves: list[object] = [None, True, 1e308, -1, 2**70, "NaN", "base", "\ud800", "ENABLE"]
        leaves += [[], {}]
        if depth == 0 or rng.random() < 0.3:
            return rng.choice(leaves)
        if rng.random() < 0.3:
            return [self._wild(depth - 1) for _ in range(rng.randrange(4))]
        return {rng.choice(names): self._wild(depth - 1) for _ in range(rng.randrange(4))}


def _ignore(reply: zenoh.Reply) -> None:
    """Leave an answer unread."""


def is_request(payload: bytes, encoding: str) -> bool:
    """Say whether a payload is a request that anybody may make."""
    try:
        request = decode(pb.ModeRequest, payload, encoding)
    except MessageRejected:
        return False
    anybodys = request.action in (pb.HOLD_NOW, pb.VENT, pb.RESET)
    return anybodys or request.take_over


class Fuzzer:
    """Sends garbage to every key."""

    def __init__(self, arm: str, endpoint: str) -> None:
        self._session = network.open_connected(endpoint)
        self._arm = arm
        self._room = threading.Semaphore(64)  # queries under way

    def send(self, seed: int, number: int) -> int:
        """Send so many, and wait until all queries among them are answered."""
        garbage, keys = Garbage(seed), random.Random(seed + 1)
        for _ in range(number):
            payload, encoding = garbage.payload()
            key = keys.choice(("cmd/target", "cmd/target", "cmd/mode", "sensor/tip_pose", "info"))
            if key == "cmd/mode" and is_request(payload, encoding):
                key = "cmd/target"
            if keys.random() < 0.02:
                key = keys.choice(("cmd", "cmd/x", "state/x", "alive/client", "sensor/\u00e9"))
            if key in ("cmd/mode", "info") and keys.random() < 0.8:
                self._ask(key, payload, encoding)
            else:
                self._put(key, payload, encoding)
        for _ in range(64):
            self._room.acquire(timeout=3.0)
        self._room.release(64)
        return number

    def _put(self, key: str, payload: bytes, encoding: str) -> None:
        self._session.put(
            full_key(self._arm, key),
            payload,
            encoding=encoding,
            congestion_control=zenoh.CongestionControl.BLOCK,
        )

    def _ask(self, key: str, payload: bytes, encoding: str) -> None:
        self._room.acquire(timeout=3.0)
        self._session.get(
            full_key(self._arm, key),
            zenoh.handlers.Callback(_ignore, self._room.release),
            payload=payload,
            encoding=encoding,
            timeout=3.0,
        )


def main() -> None:
    """Connect and obey."""
    fuzzer = Fuzzer(*sys.argv[1:])
    print("here", flush=True)
    for line in sys.stdin:
        seed, number = map(int, line.split())
        print(f"sent {fuzzer.send(seed, number)}", flush=True)


if __name__ == "__main__":
    main()
