"""A camera that lies, in a process of its own.

    python -m tools.faults.liar ARM ENDPOINT NAME

`see HZ` publishes the true tip from now on, `lie KIND` begins a lie, `honest` ends it, `blind`
publishes nothing. One line goes out for each.
"""

import select
import sys
import time
from collections.abc import Callable

import numpy as np
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame

from pneuarm import Client
from pneuarm.controllers.arm.errors import PneuarmError
from pneuarm.controllers.geometry.mountings import Mountings
from pneuarm.logs.schema.codec import encoding_of
from pneuarm.logs.schema.topics import TIP_POSE, full_key
from pneuarm.service.emulators.camera import Camera

Lie = Callable[[PoseInFrame, float], PoseInFrame]


def _shifted(pose: PoseInFrame, x_m: float) -> PoseInFrame:
    pose.pose.position.x += x_m
    return pose


def _flipped(pose: PoseInFrame, since_s: float) -> PoseInFrame:
    pose.pose.position.x *= -1.0
    pose.pose.position.y *= -1.0
    return pose


def _turned(pose: PoseInFrame, since_s: float) -> PoseInFrame:
    orientation = pose.pose.orientation
    orientation.x, orientation.y, orientation.z, orientation.w = 1.0, 0.0, 0.0, 0.0
    return pose


#: What becomes of a pose so long (s) after the lie began; a frozen one is kept by the program.
LIES: dict[str, Lie] = {
    "jump": lambda pose, since_s: _shifted(pose, 0.1 * (int(since_s / 0.7) % 2)),
    "far": lambda pose, since_s: _shifted(pose, 0.3),
    "drift": lambda pose, since_s: _shifted(pose, 0.02 * since_s),
    "flip": _flipped,
    "turn": _turned,
}


class Liar:
    """Looks at the states, and publishes what it is told to."""

    def __init__(self, client: Client, arm: str, name: str) -> None:
        self._client, self._lie = client, ""
        self._camera = Camera(100.0, 0.01, 1e-4, 1, Mountings())
        self._seeing, self._since_s = False, 0.0
        self._kept: PoseInFrame | None = None
        key = full_key(arm, f"{TIP_POSE.key}/{name}")
        self._poses = client._session.declare_publisher(key, encoding=encoding_of(PoseInFrame()))

    def run(self) -> None:
        """Until the input ends."""
        print("here", flush=True)
        while True:
            if select.select([sys.stdin], [], [], 0.002)[0]:
                line = sys.stdin.readline()
                if not line:
                    return
                self._obey(*line.split())
                print("does", line.strip(), flush=True)
            if self._seeing:
                self._look()

    def _obey(self, word: str, value: str = "") -> None:
        if word == "see":
            self._camera = Camera(float(value), 0.01, 1e-4, 1, Mountings())
        self._seeing = word != "blind"
        self._lie, self._since_s = value if word == "lie" else "", time.monotonic()

    def _look(self) -> None:
        now_s = time.monotonic()
        try:
            self._camera.see(self._client.state(), now_s)
        except PneuarmError:
            return
        while (pose := self._camera.due(now_s)) is not None:
            self._publish(pose, now_s)

    def _publish(self, pose: PoseInFrame, now_s: float) -> None:
        if self._lie == "freeze":
            kept = self._kept or pose
            kept.timestamp.CopyFrom(pose.timestamp)
            self._kept = pose = kept
        else:
            self._kept = None
        if self._lie == "late":
            late = np.random.default_rng().uniform(0.15, 0.4)
            pose.timestamp.FromNanoseconds(pose.timestamp.ToNanoseconds() - int(late * 1e9))
        if self._lie in LIES:
            pose = LIES[self._lie](pose, now_s - self._since_s)
        self._poses.put(pose.SerializeToString())


def main() -> None:
    """Connect and obey."""
    arm, endpoint, name = sys.argv[1:]
    with Client(arm, endpoint, name) as client:
        Liar(client, arm, name).run()


if __name__ == "__main__":
    main()
