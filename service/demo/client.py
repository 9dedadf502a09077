"""The client of `pneuarm demo`, a process of its own: circle, eight, a point out of reach, home.

It uses nothing but the public client. The figures' size is that of the arm whose configuration
comes on stdin; on stdout it prints one JSON object with the first and last tick of each phase.
"""

import json
import math
import sys
import time
import tomllib
from collections.abc import Callable
from functools import partial
from typing import TypeVar

import numpy as np

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import (
    DaemonUnreachable,
    HardwareError,
    ModeRefused,
    MoveTimeout,
    TargetRejected,
)
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.client.client import Client
from pneuarm.service.configuration.configuration import check

_RATE_HZ = 100.0
_CAMERA_S = 60.0
_TRIES = 4

#: After an interruption, s: the gateway may just be started again.
_PAUSE_S = 0.5

_TURN_S = 4.0

#: Step of time (s) for the velocity along a path.
_STEP_S = 1e-4

T = TypeVar("T")
Path = Callable[[float], tuple[float, float, float]]


def _figures(arm: Arm) -> tuple[float, float]:
    """Height of the figures below the base and their radius, m, both well inside the workspace."""
    low, high = length_bounds_m(arm)
    height = float(np.mean(0.5 * (low + high), axis=1).sum())
    return height, 0.2 * height


def _draw(client: Client, path: Path, seconds: float, label: str) -> tuple[int, int]:
    """Send a path for some time; return the first and last tick of it."""
    client.move_to(path(0.0))
    first = client.state().sequence
    began_s = next_s = time.monotonic()
    while (elapsed_s := time.monotonic() - began_s) < seconds:
        position = np.array(path(elapsed_s))
        velocity = (np.array(path(elapsed_s + _STEP_S)) - position) / _STEP_S
        client.send_position(position.tolist(), velocity_m_s=velocity.tolist())
        client.raise_if_refused()
        _progress(label, elapsed_s / seconds)
        next_s += 1.0 / _RATE_HZ
        time.sleep(max(0.0, next_s - time.monotonic()))
    return first, client.state().sequence


def _progress(label: str, share: float) -> None:
    if sys.stderr.isatty():
        bar = "#" * int(30 * share)
        print(f"\r{label:32} [{bar:30}]", end="", file=sys.stderr, flush=True)


def draw_figures(
    client: Client, arm: Arm, label: str, seconds: dict[str, float]
) -> dict[str, tuple[int, int]]:
    """Go through the phases that ``seconds`` names; 0 is at the figures' middle."""
    height, radius = _figures(arm)

    def circle(t: float) -> tuple[float, float, float]:
        angle = 2.0 * math.pi * t / _TURN_S
        return radius * math.cos(angle), radius * math.sin(angle), height

    def eight(t: float) -> tuple[float, float, float]:
        angle = 2.0 * math.pi * t / _TURN_S
        return radius * math.sin(angle), 0.5 * radius * math.sin(2.0 * angle), height

    phases = {}
    for name, path in (("circle", circle), ("eight", eight)):
        if name in seconds:
            draw = partial(_draw, client, path, seconds[name], f"{label}: {name}")
            phases[name] = _persist(client, draw)
    if "out of reach" in seconds:
        _progress(f"{label}: out of reach", 0.5)
        far = (1.5 * height, 0.0, 0.5 * height)
        _persist(client, partial(client.move_to, far, strict=False))
    _progress(f"{label}: home", 0.9)
    _persist(client, partial(client.move_to, (0.0, 0.0, height)))
    return phases


def _persist(client: Client, act: Callable[[], T]) -> T:
    """Do something; where a busy machine made the arm stop, arm again and do it anew.

    Nobody stands beside the arm of a show; a program that moves a real one must ask first.
    """
    for _ in range(_TRIES):
        try:
            _arm(client)
            return act()
        except (ModeRefused, TargetRejected, MoveTimeout, DaemonUnreachable) as error:
            print(f"\ninterrupted ({error}); once more", file=sys.stderr)
            time.sleep(_PAUSE_S)
            client.events()
    _arm(client)
    return act()


def _arm(client: Client) -> None:
    """Take the lease and arm; an arm that is active already stays so, a fault is left first."""
    mode = client.state().mode
    if mode == pb.FAULT:
        client.reset()
    if mode == pb.ACTIVE:
        client.take_lease()
    else:
        client.enable()


def _wait_for_camera(client: Client) -> None:
    """Wait until measured tip poses arrive."""
    give_up_s = time.monotonic() + _CAMERA_S
    while client.state().tip_estimated_source != pb.FROM_TIP_POSE:
        if time.monotonic() > give_up_s:
            raise HardwareError("no measured tip pose arrives from the simulated camera")
        time.sleep(0.02)


def main() -> int:
    """Run against the daemon named on the command line: arm, endpoint, what to do as JSON."""
    name, endpoint = sys.argv[1:3]
    wanted = json.loads(sys.argv[3])
    arm = check(tomllib.loads(sys.stdin.read())).build_arm()
    with Client(name, endpoint, "demo") as client:
        if wanted["camera"]:
            _wait_for_camera(client)
        phases = draw_figures(client, arm, wanted["label"], wanted["seconds"])
    print(json.dumps(phases))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
