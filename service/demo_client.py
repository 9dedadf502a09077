"""The client of `pneuarm demo`, a process of its own: circle, eight, a point out of reach, home.

It uses nothing but the public client. On stdout it prints one JSON object with the tick numbers
at which each phase began and ended.
"""

import json
import math
import sys
import time
import tomllib
from collections.abc import Callable

import numpy as np

from controllers.actuation import length_bounds_m
from controllers.arm import Arm
from service.client import Client
from service.config import check

_RATE_HZ = 100.0
_TURN_S = 4.0

#: Shares of the whole time.
_CIRCLE, _EIGHT = 0.45, 0.45

Path = Callable[[float], tuple[float, float, float]]


def _figures(arm: Arm) -> tuple[float, float]:
    """Height of the figures below the base and their radius, m, both well inside the workspace."""
    low, high = length_bounds_m(arm)
    height = float(np.mean(0.5 * (low + high), axis=1).sum())
    return height, 0.2 * height


def _draw(client: Client, path: Path, seconds: float, label: str) -> tuple[int, int]:
    """Send a path for some whole turns; return the first and last tick of it."""
    client.move_to(path(0.0))
    first = client.state().sequence
    began_s = next_s = time.monotonic()
    while (elapsed_s := time.monotonic() - began_s) < seconds:
        client.send_position(path(elapsed_s))
        client.raise_if_refused()
        _progress(label, elapsed_s / seconds)
        next_s += 1.0 / _RATE_HZ
        time.sleep(max(0.0, next_s - time.monotonic()))
    return first, client.state().sequence


def _progress(label: str, share: float) -> None:
    if sys.stderr.isatty():
        bar = "#" * int(30 * share)
        print(f"\r{label:14} [{bar:30}]", end="", file=sys.stderr, flush=True)


def perform(client: Client, seconds: float) -> dict[str, tuple[int, int]]:
    """Go through the whole show in about ``seconds``."""
    arm = check(tomllib.loads(client.info().config_toml)).build_arm()
    height, radius = _figures(arm)
    turn_s = min(_TURN_S, _CIRCLE * seconds)
    omega = 2.0 * math.pi / turn_s

    def circle(t: float) -> tuple[float, float, float]:
        return radius * math.cos(omega * t), radius * math.sin(omega * t), height

    def eight(t: float) -> tuple[float, float, float]:
        sine = math.sin(omega * t)
        return radius * sine, radius * sine * math.cos(omega * t), height

    phases = {}
    client.enable()
    phases["circle"] = _draw(client, circle, _CIRCLE * seconds, "circle")
    phases["eight"] = _draw(client, eight, _EIGHT * seconds, "figure of eight")
    _progress("out of reach", 0.5)
    client.move_to((1.5 * height, 0.0, 0.5 * height))
    _progress("home", 0.9)
    client.move_to((0.0, 0.0, height))
    return phases


def main() -> int:
    """Run against the daemon named on the command line: arm, endpoint, seconds."""
    arm, endpoint, seconds = sys.argv[1:4]
    with Client(arm, endpoint, "demo") as client:
        phases = perform(client, float(seconds))
    print(json.dumps(phases))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
