"""`pneuarm send`, `enable`, `hold`, `vent`, `reset` and `state`."""

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path

from google.protobuf import json_format
from google.protobuf.message import Message

from pneuarm.controllers.arm.errors import ModeRefused
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.event_line import event_line
from pneuarm.logs.schema.printable import name_of
from pneuarm.service.cli.shape_arguments import duration_s, shape_of
from pneuarm.service.cli.text import outcome, radians, state_line
from pneuarm.service.client.client import Client
from pneuarm.service.client.target_messages import (
    direction_target,
    point_target,
    pose_target,
    position_target,
    twist_target,
)

_LAWS = {None: pb.DEFAULT, "resolved_rate": pb.RESOLVED_RATE, "qp_ik": pb.QP_IK}
_REFRESH_S = 0.02


def _connect(arguments: argparse.Namespace) -> Client:
    return Client(arguments.arm, arguments.connect, "pneuarm", arguments.zenoh_config)


def _as_json(message: Message) -> str:
    return json_format.MessageToJson(message, preserving_proto_field_name=True, indent=None)


def _show(arguments: argparse.Namespace, message: Message, text: str) -> None:
    print(_as_json(message) if arguments.json else text, flush=True)


def target_of(arguments: argparse.Namespace) -> pb.Target:
    """Return the target of a `send` command, in SI units."""
    law, values = _LAWS[arguments.law], getattr(arguments, "values", [])
    match arguments.kind:
        case "position":
            return position_target([1e-3 * value for value in values], law)
        case "pose":
            return pose_target([1e-3 * value for value in values[:3]], values[3:], law)
        case "direction":
            return direction_target(values, law)
        case "point":
            return point_target([1e-3 * value for value in values], arguments.station, law)
        case "twist":
            linear = [1e-3 * value for value in values]
            angular = radians(arguments.angular)
            return twist_target(linear, angular, arguments.frame, arguments.point, law)
        case "lengths":
            lengths = pb.LengthsTarget(length_m=[1e-3 * value for value in values])
            return pb.Target(lengths=lengths, law=law)
        case "circle" | "line" | "trajectory":
            return shape_of(arguments, law)
    pressures = pb.PressuresTarget(pressure_pa=[1e5 * value for value in values])
    return pb.Target(pressures=pressures, law=law)


def send(arguments: argparse.Namespace) -> int:
    """Refresh a target until it is reached; leave the arm holding."""
    target = target_of(arguments)
    with _connect(arguments) as client:
        if arguments.kind == "trajectory" and arguments.learned is not None:
            target = _with_learned(client, target, arguments.learned)
        if client.state().mode != pb.ACTIVE or arguments.take_over:
            if not arguments.enable:
                mode = name_of(pb.Mode, client.state().mode)
                raise ModeRefused(f"the arm is in mode {mode}; add --enable to arm it first")
            client.enable(arguments.take_over)
        else:
            client.take_lease(arguments.take_over)
        if arguments.kind == "twist":
            state = _send_twist(client, target, arguments.seconds)
            text = f"moved for {arguments.seconds:g} s; {state_line(state)}"
        else:
            longest_s = arguments.timeout + duration_s(target)
            state = client.wait_until_reached(target, longest_s, strict=False)
            text = outcome(state)
    _show(arguments, state, text + "; the arm holds")
    return 0 if state.reach != pb.OUT_OF_REACH else 2


def _with_learned(client: Client, target: pb.Target, path: Path) -> pb.Target:
    """Add what was learnt; loaded only now, as it needs what no other target does."""
    from pneuarm.service.configuration.configuration import recorded
    from pneuarm.service.learning.apply import with_learned

    return with_learned(target, path, recorded(client.info().config_toml, "the daemon"))


def _send_twist(client: Client, target: pb.Target, seconds: float) -> pb.ArmState:
    until = time.monotonic() + seconds
    client.events()
    while time.monotonic() < until:
        client.send(target)
        time.sleep(_REFRESH_S)
        client.raise_if_refused()
    return client.state()


def mode(arguments: argparse.Namespace) -> int:
    """Ask for a mode."""
    with _connect(arguments) as client:
        actions: dict[str, Callable[[], pb.Reply]] = {
            "enable": lambda: client.enable(arguments.take_over),
            "hold": client.hold,
            "vent": client.vent,
            "reset": client.reset,
        }
        reply = actions[arguments.command]()
    _show(arguments, reply, f"mode is {name_of(pb.Mode, reply.mode)}")
    return 0


def state(arguments: argparse.Namespace) -> int:
    """Show the newest state, or all of them as they come."""
    with _connect(arguments) as client:
        if not arguments.follow:
            newest, latched = client.state(), client.past_events().latched
            if arguments.json:
                told = [json.loads(_as_json(event)) for event in latched]
                print(json.dumps(json.loads(_as_json(newest)) | {"latched_events": told}))
            else:
                print("\n".join([state_line(newest), *(event_line(event) for event in latched)]))
            return 0
        last_s = 0.0
        for newest in client.states():
            # A person reads ten lines a second, a program takes what comes.
            if arguments.json or time.monotonic() - last_s >= 0.1:
                last_s = time.monotonic()
                _show(arguments, newest, state_line(newest))
    return 0
