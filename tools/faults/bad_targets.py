"""Targets that the holder of the lease sends and that are none: each must change nothing."""

import math
import random
from collections.abc import Callable

from pneuarm import Client
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.client.target_messages import position_target


def _vector(value: float, rng: random.Random) -> tuple[float, float, float]:
    values = [0.01, 0.01, 0.2]
    values[rng.randrange(3)] = value
    return values[0], values[1], values[2]


def _frame(rng: random.Random) -> pb.Target:
    target = position_target((0.0, 0.0, 0.2))
    target.position.frame_id = rng.choice(("", "world", "tip", "\U0001f40d" * 50))
    return target


def _count(rng: random.Random) -> pb.Target:
    return pb.Target(lengths=pb.LengthsTarget(length_m=[0.2] * rng.choice((0, 1, 2, 4, 300))))


def _lengths(rng: random.Random) -> pb.Target:
    lengths = [0.2, 0.2, 0.2]
    lengths[rng.randrange(3)] = rng.choice((0.0999, 0.3001, -0.2, 1e300, math.nan))
    return pb.Target(lengths=pb.LengthsTarget(length_m=lengths))


def _pressures(rng: random.Random) -> pb.Target:
    pressures = [0.0, 0.0, 0.0]
    pressures[rng.randrange(3)] = rng.choice((9.1e4, -9.1e4, 1e308, math.nan, -math.inf))
    return pb.Target(pressures=pb.PressuresTarget(pressure_pa=pressures))


BAD: tuple[Callable[[random.Random], pb.Target], ...] = (
    lambda rng: position_target(_vector(math.nan, rng)),
    lambda rng: position_target(_vector(rng.choice((math.inf, -math.inf)), rng)),
    lambda rng: position_target(_vector(rng.uniform(1.0, 1e9), rng)),
    lambda rng: pb.Target(),
    _frame,
    _count,
    _lengths,
    _pressures,
)


def send_bad(client: Client, rng: random.Random) -> None:
    """Send one bad target with everything else right: secret, sequence, state."""
    client.send(rng.choice(BAD)(rng))
    _send_old(client, rng)


def _send_old(client: Client, rng: random.Random) -> None:
    """Send a good target whose numbers are old: a repeated one, or one from a stalled network."""
    client._sequence += 1
    target = position_target((0.0, 0.0, 0.25))
    target.client_id, target.lease_secret = client.client_id, client._secret
    target.sequence = client._sequence
    target.state_sequence = client.state().sequence
    if rng.random() < 0.5:
        target.sequence = rng.randrange(0, max(1, client._sequence - 2))
    else:
        target.state_sequence = max(0, target.state_sequence - rng.randrange(1000, 100_000))
    client._targets.put(target.SerializeToString())
