"""A program that moves the arm, in a process of its own, so that it can be killed and frozen.

    python -m tools.faults.mover ARM ENDPOINT NAME

One word a line comes in: `go` arms and follows a circle, `flood S` sends 10 000 targets a second
for S seconds, `bad` mixes targets that are none into the good ones, `fight S SEED` takes the arm
over again and again. One line goes out for whatever it has done. It ends with its input.
"""

import contextlib
import math
import os
import random
import select
import sys
import time

from pneuarm import Client
from pneuarm.controllers.arm.errors import PneuarmError
from pneuarm.logs.schema import pneuarm_pb2 as pb
from tools.faults.bad_targets import send_bad

REFRESH_S = 0.02
FLOOD_HZ = 10_000


def say(text: str) -> None:
    """Tell the campaign."""
    print(text, flush=True)


def point(phase: float) -> tuple[float, float, float]:
    """Return a point of the circle, m; it passes once in two seconds."""
    turn = math.pi * (time.monotonic() + phase)
    return 0.03 * math.cos(turn), 0.03 * math.sin(turn), 0.2


class Mover:
    """Follows what it is told, one line after the other."""

    def __init__(self, client: Client) -> None:
        self._client = client
        self._moving = self._bad = False
        self._random = random.Random(0)

    def run(self) -> None:
        """Until the input ends."""
        say("here")
        while True:
            wait_s = REFRESH_S if self._moving else None
            if select.select([sys.stdin], [], [], wait_s)[0]:
                lines = os.read(0, 4096).decode()  # one line at a time: each is answered
                if not lines:
                    return
                self._obey(*lines.split())
            if self._moving:
                self._move()

    def _obey(self, word: str, *values: str) -> None:
        match word:
            case "go" | "bad":
                self._bad = word == "bad"
                self._go()
            case "flood":
                self._flood(float(values[0]))
            case "fight":
                self._fight(float(values[0]), int(values[1]))

    def _go(self) -> None:
        """Arm, however long that takes, and take the first step."""
        self._moving = False
        while not self._moving:
            try:
                active = self._client.state().mode == pb.ACTIVE
                take = self._client.take_lease if active else self._client.enable
                self._moving = take(take_over=True).mode == pb.ACTIVE
                self._move()
            except PneuarmError:
                time.sleep(0.02)
        say("moves")

    def _move(self) -> None:
        """Refresh the target; stand still when the arm has left active, as a program should."""
        try:
            if self._client.state().mode != pb.ACTIVE:
                self._moving = False
                return
            self._client.send_position(point(0.0))
            if self._bad:
                send_bad(self._client, self._random)
        except PneuarmError:
            self._moving = False

    def _flood(self, seconds: float) -> None:
        """Send targets at 10 kHz, each well-formed; who holds no lease sends them all the same."""
        begin = time.monotonic()
        sent = 0
        while (elapsed := time.monotonic() - begin) < seconds:
            while sent < elapsed * FLOOD_HZ:
                with contextlib.suppress(PneuarmError):
                    self._client.send_position(point(0.1 * (sent % 2)))
                sent += 1
        say(f"flooded {sent / (time.monotonic() - begin):.0f}")

    def _fight(self, seconds: float, seed: int) -> None:
        """Take over at random moments and send targets as long as the lease lasts."""
        self._moving = False
        rng, until, taken = random.Random(seed), time.monotonic() + seconds, 0
        side = rng.random()
        while time.monotonic() < until:
            with contextlib.suppress(PneuarmError):
                if rng.random() < 0.2:
                    self._client.enable(take_over=True, timeout_s=0.1)
                    taken += 1
                self._client.send_position(point(side))
            time.sleep(rng.uniform(0.002, 0.03))
        say(f"fought {taken}")


def main() -> None:
    """Connect and obey."""
    arm, endpoint, name = sys.argv[1:]
    with Client(arm, endpoint, name) as client:
        Mover(client).run()


if __name__ == "__main__":
    main()
