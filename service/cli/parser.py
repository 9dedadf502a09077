"""The command line. Units at the prompt are millimetres, degrees and bar."""

import argparse
import importlib
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from pneuarm.__main__ import asks_to_stop
from pneuarm.service.cli.ending import ended
from pneuarm.service.cli.values import Parser, number, whole

Command = Callable[[argparse.Namespace], int]
Subparsers: TypeAlias = "argparse._SubParsersAction[Parser]"

PRESETS = ("paper", "table1", "trunk")

_ENDPOINT = "tcp/127.0.0.1:7447"
_POSITIVE = number(0, above=True)
_WAYPOINTS = "lines of: time in s, then x y z in mm"
_SEED = whole(0, 2**32 - 1)


def _call(where: str, arguments: argparse.Namespace) -> int:
    """Call "module:function"; loaded only now, so that no command waits for the others' imports."""
    module, _, name = where.partition(":")
    function: Command = getattr(importlib.import_module(module), name)
    return function(arguments)


def _complete_when_used(parser: Parser, complete: Callable[[Parser], None]) -> None:
    """Add what the installed devices need once it is parsed: other commands do not wait for it."""
    plain = parser.parse_known_args

    def parse(args: Any = None, namespace: Any = None) -> Any:
        parser.parse_known_args = plain  # type: ignore[method-assign]
        complete(parser)
        return plain(args, namespace)

    parser.parse_known_args = parse  # type: ignore[method-assign]


def build_parser() -> Parser:
    """Return the parser of all commands."""
    parser = Parser(
        prog="pneuarm", description="Real-time control service for soft pneumatic arms."
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    _add_daemon(commands)
    _add_emulate(commands)
    _add_client(commands)
    _add_logs(commands)
    _add_validate(commands)
    _add_workspace(commands)
    _add_machine(commands)
    _add_calibrate(commands)
    _add_learn(commands)
    return parser


def _command(commands: Subparsers, name: str, where: str, help_text: str) -> Parser:
    parser = commands.add_parser(name, help=help_text, description=help_text)
    parser.set_defaults(where=where)
    return parser


def _add_daemon(commands: Subparsers) -> None:
    run = _command(
        commands,
        "run",
        "pneuarm.service.cli.daemon_commands:run",
        "Run the daemon until Ctrl-C; it ends with vented arm.",
    )
    config = _command(
        commands,
        "config",
        "pneuarm.service.cli.daemon_commands:config",
        "Show the effective configuration, or check.",
    )
    config.add_argument("action", choices=("show", "check"))
    for parser in (run, config):
        parser.add_argument("config", nargs="?", type=Path, metavar="CONFIG.toml")
        parser.add_argument("--arm", choices=PRESETS, help="a built-in arm (default: paper)")
    run.add_argument("--viewer", action="store_true", help="open Rerun's window, with a display")
    demo = _command(
        commands,
        "demo",
        "pneuarm.service.demo.demo:demo",
        "Draw an eight: uncalibrated, calibrated, tip measured; or with an emulated device.",
    )
    demo.add_argument(
        "--seconds", type=number(1, 3600), default=30.0, help="length of the show (default 30)"
    )
    _complete_when_used(demo, _add_adapter)
    demo.add_argument("--arm", choices=PRESETS, default="paper")
    demo.add_argument("--seed", type=_SEED, default=0, help="seed of the simulated arm")
    demo.add_argument("--json", action="store_true", help="one JSON object instead of the table")


def _add_emulate(commands: Subparsers) -> None:
    help_text = "A device without the device, for tests."
    emulate = commands.add_parser("emulate", help=help_text, description=help_text)
    devices = emulate.add_subparsers(dest="what", required=True, metavar="DEVICE")
    _complete_when_used(emulate, lambda _: _add_emulated_devices(devices))
    _add_emulated_camera(devices)


def _add_emulated_devices(commands: Subparsers) -> None:
    from pneuarm.service.configuration.devices import emulated_devices

    for device in emulated_devices():
        parser = _command(
            commands,
            device.name,
            "pneuarm.service.emulators.command:emulate",
            f"{device.summary}, with the simulated arm behind it.",
        )
        parser.add_argument("--arm", default="paper", metavar="PRESET|CONFIG.toml")
        parser.add_argument("--seed", type=_SEED, default=0, help="seed of the arm behind it")
        parser.add_argument("--record", type=Path, metavar="FILE", help="what reaches it: JSON")
        _add_valves(parser, None, "those of --arm's file")
        device.add_arguments(parser)


def _add_adapter(demo: Parser) -> None:
    from pneuarm.hardware.simulator.device import DEVICE as SIMULATOR
    from pneuarm.service.configuration.devices import shown_devices

    names = [device.name for device in shown_devices()]
    demo.add_argument("--adapter", choices=names, default=SIMULATOR.name)
    _add_valves(demo, "servo", "servo")


def _add_valves(parser: Parser, default: str | None, said: str) -> None:
    from pneuarm.hardware.simulator.parameters import NOMINAL

    help_text = f"valves of the simulated arm (default: {said})"
    parser.add_argument("--valves", choices=tuple(NOMINAL), default=default, help=help_text)


def _add_emulated_camera(devices: Subparsers) -> None:
    help_text = "Motion capture that sees the tip of a simulated arm."
    camera = _command(
        devices, "camera", "pneuarm.service.emulators.camera:emulate_camera", help_text
    )
    camera.add_argument("--arm", default="paper", help="name of the arm (default: paper)")
    camera.add_argument("--connect", default=_ENDPOINT, help=f"daemon (default: {_ENDPOINT})")
    camera.add_argument(
        "--rate", type=number(0, 1e4, above=True), default=100.0, help="poses a second (100)"
    )
    camera.add_argument("--delay-ms", type=number(0, 1e4), default=10.0, help="age of a pose (10)")
    camera.add_argument("--noise-mm", type=number(0, 1e4), default=0.1, help="on every axis (0.1)")
    camera.add_argument("--seed", type=_SEED, default=0, help="seed of the noise")
    camera.add_argument("--seconds", type=number(0), default=0.0, help="end after (0: Ctrl-C)")


def _add_client(commands: Subparsers) -> None:
    send = _command(
        commands,
        "send",
        "pneuarm.service.cli.client_commands:send",
        "Send a target until it is reached; then the arm holds.",
    )
    kinds = send.add_subparsers(dest="kind", required=True, metavar="KIND")
    position = kinds.add_parser("position", help="tip position in the base frame, mm")
    pose = kinds.add_parser("pose", help="tip position, mm, and quaternion x y z w")
    direction = kinds.add_parser("direction", help="where the tip points, in the base frame")
    point = kinds.add_parser("point", help="a point of the backbone at a position, mm")
    twist = kinds.add_parser("twist", help="tip velocity, mm/s, for some seconds")
    # One name for all values: where some are missing, argparse cannot tell a tuple of names.
    for parser, count, names in (
        (position, 3, "X Y Z, mm"),
        (pose, 7, "X Y Z, mm, QX QY QZ QW"),
        (direction, 3, "DX DY DZ"),
        (point, 3, "X Y Z, mm"),
        (twist, 3, "VX VY VZ, mm/s"),
    ):
        parser.add_argument("values", nargs=count, type=float, metavar="VALUE", help=names)
    point.add_argument("--station", type=number(0, 1), required=True, help="0 the base, 1 the tip")
    twist.add_argument("--angular", nargs=3, type=float, metavar=("WX", "WY", "WZ"), help="deg/s")
    twist.add_argument("--frame", choices=("base", "tip"), default="base")
    twist.add_argument("--point", choices=("tip", "base"), default="tip", help="reference point")
    twist.add_argument("--seconds", type=_POSITIVE, default=1.0)
    lengths = kinds.add_parser("lengths", help="chamber lengths, three a section, mm")
    pressures = kinds.add_parser("pressures", help="gauge pressures, three a section, bar")
    for parser in (lengths, pressures):
        parser.add_argument("values", nargs="+", type=float, metavar="VALUE")
    shapes = _add_shapes(kinds)
    for parser in (position, pose, direction, point, twist, lengths, pressures, *shapes):
        _add_connection(parser)
        parser.add_argument("--enable", action="store_true", help="arm first")
        parser.add_argument("--take-over", action="store_true", help="take the lease from another")
        parser.add_argument("--law", choices=("resolved_rate", "qp_ik"))
        parser.add_argument("--timeout", type=_POSITIVE, default=10.0, help="give up after (s)")
    helps = {
        "enable": "Take the lease and arm; the next `send` goes on from there.",
        "hold": "Keep the last pressures.",
        "vent": "Let the air out, to idle.",
        "reset": "Leave fault or estop, to idle.",
    }
    for name, text in helps.items():
        parser = _command(commands, name, "pneuarm.service.cli.client_commands:mode", text)
        _add_connection(parser)
        if name == "enable":
            parser.add_argument("--take-over", action="store_true")
    _add_connection(
        _command(
            commands,
            "estop",
            "pneuarm.service.cli.stop:estop",
            "Stop: vent at once, and latch.",
        )
    )
    state = _command(
        commands, "state", "pneuarm.service.cli.client_commands:state", "Show the newest state."
    )
    state.add_argument("--follow", action="store_true", help="go on until Ctrl-C")
    _add_connection(state)


def _add_shapes(kinds: Subparsers) -> list[Parser]:
    circle = kinds.add_parser("circle", help="tip on a circle: center and radius, mm")
    circle.add_argument("values", nargs=4, type=float, metavar="VALUE", help="X Y Z RADIUS, mm")
    circle.add_argument("--frequency", type=_POSITIVE, default=0.25, help="turns a second (0.25)")
    circle.add_argument("--turns", type=_POSITIVE, default=1.0)
    circle.add_argument("--normal", nargs=3, type=float, default=(0.0, 0.0, 1.0), metavar="N")
    line = kinds.add_parser("line", help="tip from one point to another and back, mm")
    line.add_argument("values", nargs=6, type=float, metavar="VALUE", help="X Y Z X Y Z, mm")
    line.add_argument("--period", type=_POSITIVE, default=4.0, help="s, there and back (4)")
    line.add_argument("--repeats", type=_POSITIVE, default=1.0)
    trajectory = kinds.add_parser("trajectory", help="tip through timed waypoints of a file")
    trajectory.add_argument("file", type=Path, help=_WAYPOINTS)
    trajectory.add_argument("--learned", type=Path, metavar="FILE", help="what `learn` has written")
    return [circle, line, trajectory]


def _add_connection(parser: Parser) -> None:
    parser.add_argument("--arm", default="paper", help="name of the arm (default: paper)")
    parser.add_argument("--connect", default=_ENDPOINT, help=f"daemon (default: {_ENDPOINT})")
    parser.add_argument("--zenoh-config", default="", help="Zenoh configuration, for TLS")
    parser.add_argument("--json", action="store_true", help="JSON instead of text")


def _add_logs(commands: Subparsers) -> None:
    replay = _command(
        commands,
        "replay",
        "pneuarm.service.replay.command:replay",
        "Show a recorded session again.",
    )
    replay.add_argument("log", type=Path)
    replay.add_argument("--speed", type=_POSITIVE, default=1.0)
    replay.add_argument("--loop", action="store_true")
    replay.add_argument("--to", choices=("rerun", "zenoh"), default="rerun")
    replay.add_argument("--listen", default=_ENDPOINT, help="where to listen, with --to zenoh")
    replay.add_argument("--port", type=whole(1, 65535), default=9876, help="port of Rerun's server")
    info = _command(
        commands,
        "info",
        "pneuarm.service.replay.command:info",
        "Say what is in a recorded session.",
    )
    info.add_argument("log", type=Path)
    info.add_argument("--json", action="store_true")


def _add_validate(commands: Subparsers) -> None:
    help_text = "Compare the model with the paper's measurements."
    validate = _command(
        commands, "validate", "pneuarm.service.validation.command:validate", help_text
    )
    validate.add_argument("what", choices=("table1",))
    validate.add_argument("--table", type=Path, metavar="FILE.csv", help="another such table")
    validate.add_argument("--json", action="store_true", help="one JSON object instead")


def _add_workspace(commands: Subparsers) -> None:
    workspace = _command(
        commands,
        "workspace",
        "pneuarm.service.workspace.command:workspace",
        "Where the tip can be, and how well.",
    )
    workspace.add_argument("--arm", choices=PRESETS, default="paper")
    workspace.add_argument("--out", type=Path, metavar="DIR", help="write picture, mesh, samples")
    workspace.add_argument(
        "--samples", type=whole(1, 10_000_000), default=20000, help="random points (20000)"
    )
    workspace.add_argument("--seed", type=_SEED, default=0, help="seed of the random points")
    workspace.add_argument("--json", action="store_true", help="one JSON object instead of text")


def _add_machine(commands: Subparsers) -> None:
    doctor = _command(
        commands,
        "doctor",
        "pneuarm.service.doctor.command:doctor",
        "Is this PC ready, and what must be changed.",
    )
    doctor.add_argument("--json", action="store_true", help="one JSON object instead of text")
    systemd = _command(
        commands,
        "systemd",
        "pneuarm.service.systemd.unit:systemd",
        "Print a unit file: the daemon as a service.",
    )
    systemd.add_argument("--user", help="who runs it (default: you)")
    for parser in (doctor, systemd):
        parser.add_argument("config", nargs="?", type=Path, metavar="CONFIG.toml")
        parser.add_argument("--arm", choices=PRESETS, help="a built-in arm (default: paper)")


def _add_calibrate(commands: Subparsers) -> None:
    help_text = "Move the arm, fit the map between pressure and length, write a configuration."
    calibrate = _command(
        commands, "calibrate", "pneuarm.service.calibration.command:run", help_text
    )
    _add_connection(calibrate)
    calibrate.set_defaults(arm=None)  # a log says by itself whose it is
    calibrate.add_argument("--out", type=Path, default=Path(), metavar="DIR", help="(default: .)")
    calibrate.add_argument(
        "--from", dest="from_logs", nargs="+", type=Path, metavar="LOG", help="recorded sessions"
    )
    calibrate.add_argument(
        "--resume", action="store_true", help="go on with the motion that was broken off in --out"
    )
    calibrate.add_argument(
        "--world", action="store_true", help="poses are of a marker, in a frame not the base's"
    )


def _add_learn(commands: Subparsers) -> None:
    help_text = "Repeat a trajectory with the tip measured, and learn to follow it better."
    learn = _command(commands, "learn", "pneuarm.service.learning.command:run", help_text)
    learn.add_argument("trajectory", type=Path, metavar="TRAJECTORY", help=_WAYPOINTS)
    learn.add_argument(
        "--trials", type=whole(2, 1000), default=10, help="how often, the first unchanged (10)"
    )
    learn.add_argument(
        "--output",
        type=Path,
        metavar="FILE",
        help="where to write what was learnt (TRAJECTORY-learned.toml)",
    )
    _add_connection(learn)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; an error is one sentence on stderr and the exit status 1 (2: its usage)."""
    words = sys.argv[1:] if arguments is None else list(arguments)

    def command() -> int:
        parsed = build_parser().parse_args(words)
        return _call(parsed.where, parsed)

    return ended(command, stops=asks_to_stop(words))
