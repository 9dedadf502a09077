"""The command line: every command parses, bad numbers end with the usage, an error is one line."""

import argparse
import json
import math
import socket
from pathlib import Path

import pytest

from pneuarm.controllers.arm.errors import LeaseRefused
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.cli.client_commands import target_of
from pneuarm.service.cli.parser import build_parser, main
from pneuarm.service.configuration.configuration import load
from tools.rig.recording import make_session

CONNECTION = ["--arm", "trunk", "--connect", "tcp/127.0.0.1:9", "--zenoh-config", "z", "--json"]
POSE = ["1", "2", "3", "0", "0", "0", "1"]

COMMANDS = [
    ("cli.daemon_commands.run", ["run"]),
    ("cli.daemon_commands.run", ["run", "own.toml", "--viewer"]),
    ("cli.daemon_commands.run", ["run", "--arm", "trunk"]),
    ("demo.demo.demo", ["demo"]),
    (
        "demo.demo.demo",
        ["demo", "--seconds", "3", "--arm", "table1", "--seed", "4", "--json"],
    ),
    ("cli.client_commands.send", ["send", "position", "-40", "0.5", "-.5"]),
    (
        "cli.client_commands.send",
        ["send", "position", "40", "0", "200", "--enable", "--take-over", *CONNECTION],
    ),
    (
        "cli.client_commands.send",
        ["send", "position", "4", "0", "2", "--law", "resolved_rate", "--timeout", "3"],
    ),
    ("cli.client_commands.send", ["send", "pose", *POSE]),
    ("cli.client_commands.send", ["send", "twist", "1", "2", "3"]),
    (
        "cli.client_commands.send",
        ["send", "twist", "1", "2", "-3", "--angular", "1", "2", "-3", "--frame", "tip"],
    ),
    (
        "cli.client_commands.send",
        ["send", "twist", "1", "2", "3", "--point", "base", "--seconds", "2"],
    ),
    ("cli.client_commands.send", ["send", "lengths", "200", "210", "190"]),
    (
        "cli.client_commands.send",
        ["send", "pressures", "-0.5", "0", "0.5", "--enable"],
    ),
    ("cli.client_commands.mode", ["enable", "--take-over", *CONNECTION]),
    ("cli.client_commands.mode", ["hold", *CONNECTION]),
    ("cli.client_commands.mode", ["vent"]),
    ("cli.client_commands.mode", ["reset"]),
    ("cli.stop.estop", ["estop", *CONNECTION]),
    ("cli.client_commands.state", ["state", "--follow", *CONNECTION]),
    (
        "replay.command.replay",
        ["replay", "x.mcap", "--speed", "2", "--loop", "--to", "zenoh", "--port", "99"],
    ),
    ("replay.command.info", ["info", "x.mcap", "--json"]),
    ("cli.daemon_commands.config", ["config", "show"]),
    ("cli.daemon_commands.config", ["config", "check", "own.toml"]),
    ("doctor.command.doctor", ["doctor"]),
    ("doctor.command.doctor", ["doctor", "own.toml", "--json"]),
    ("systemd.unit.systemd", ["systemd", "own.toml", "--user", "ada"]),
    ("systemd.unit.systemd", ["systemd", "--arm", "trunk"]),
]


@pytest.mark.parametrize(("function", "arguments"), COMMANDS, ids=lambda value: str(value)[:40])
def test_every_command_parses_and_runs_its_function(
    function: str, arguments: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    called: list[argparse.Namespace] = []

    def run(parsed: argparse.Namespace) -> int:
        called.append(parsed)
        return 7

    monkeypatch.setattr(f"pneuarm.service.{function}", run)
    assert main(arguments) == 7
    assert called[0].command == arguments[0]


def test_what_was_not_said_has_its_default() -> None:
    parsed = build_parser().parse_args(["send", "position", "1", "2", "3"])
    assert (parsed.arm, parsed.connect) == ("paper", load().zenoh.listen[0])
    assert (parsed.enable, parsed.take_over, parsed.law, parsed.timeout) == (False, False, None, 10)
    replay = build_parser().parse_args(["replay", "x"])
    assert (replay.speed, replay.loop, replay.to) == (1.0, False, "rerun")


@pytest.mark.parametrize(
    ("arguments", "facts"),
    [
        ([], ("COMMAND",)),
        (["fly"], ("'fly'", "run", "estop")),
        (["send"], ("KIND",)),
        (["send", "position", "a", "b", "c"], ("VALUE", "'a'", "number")),
        (["send", "position", "1", "2"], ("VALUE", "required")),
        (["send", "position", "1", "2", "3", "4"], ("4",)),
        (["send", "pose", "1", "2", "3", "0", "0", "0"], ("VALUE", "required")),
        (["send", "lengths"], ("VALUE", "required")),
        (["send", "lengths", "200", "two", "200"], ("VALUE", "'two'")),
        (["send", "position", "nan", "0", "200"], ("VALUE", "'nan'", "finite")),
        (["send", "position", "-1,5", "0", "200"], ("VALUE", "'-1,5'", "number")),
        (["send", "position", "-20mm", "0", "200"], ("VALUE", "'-20mm'", "number")),
        (["send", "position", "-.5,0", "0", "200"], ("VALUE", "'-.5,0'", "number")),
        (["send", "twist", "1", "2", "3", "--seconds", "-1,5"], ("--seconds", "'-1,5'", "number")),
        (["send", "position", "1e999", "0", "200"], ("VALUE", "'1e999'", "finite")),
        (["send", "twist", "1", "2", "3", "--seconds", "soon"], ("--seconds", "'soon'")),
        (["send", "twist", "1", "2", "3", "--seconds", "-1"], ("--seconds", "'-1'", "above 0")),
        (["send", "twist", "1", "2", "3", "--frame", "world"], ("--frame", "'world'", "tip")),
        (["emulate", "esp32", "--port", "5020"], ("--port",)),
        (["emulate", "ctrl-p", "--fail-safe", "hold"], ("--fail-safe",)),
        (["send", "position", "1", "2", "3", "--law", "pid"], ("--law", "'pid'", "qp_ik")),
        (["run", "--arm", "octopus"], ("--arm", "'octopus'", "trunk")),
        (["demo", "--seed", "1.5"], ("--seed", "'1.5'", "whole")),
        (["demo", "--seed", "-1"], ("--seed", "'-1'", "0")),
        (["replay", "x", "--speed", "fast"], ("--speed", "'fast'")),
        (["replay", "x", "--port", "70000"], ("--port", "'70000'", "65535")),
        (["replay"], ("log",)),
        (["config"], ("action",)),
    ],
)
def test_a_command_that_is_wrong_is_told_in_one_sentence(
    arguments: list[str], facts: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.startswith("pneuarm: ")
    assert told.err.count("\n") == 1
    assert all(fact in told.err for fact in facts)


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [
        (LeaseRefused("bob holds the arm"), 1, "pneuarm: bob holds the arm\n"),
        (KeyboardInterrupt(), 130, ""),
        (BrokenPipeError(), 0, ""),
    ],
)
def test_an_error_is_one_sentence_and_a_status(
    error: BaseException,
    status: int,
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(parsed: argparse.Namespace) -> int:
        raise error

    monkeypatch.setattr("pneuarm.service.cli.client_commands.state", fail)
    assert main(["state"]) == status
    assert capsys.readouterr() == ("", said)


def sent(*arguments: str) -> pb.Target:
    return target_of(build_parser().parse_args(["send", *arguments]))


def test_millimetres_degrees_and_bar_at_the_prompt_are_si_on_the_wire() -> None:
    position = sent("position", "40", "-20", "200", "--law", "qp_ik")
    vector = position.position.position_m
    assert (vector.x, vector.y, vector.z) == pytest.approx((0.04, -0.02, 0.2))
    assert (position.position.frame_id, position.law) == ("base", pb.QP_IK)
    pose = sent("pose", "1", "2", "3", "0.5", "-0.5", "0.5", "0.5").pose
    assert (pose.position_m.z, pose.orientation.y) == pytest.approx((0.003, -0.5))
    twist = sent("twist", "10", "0", "0", "--angular", "0", "0", "180", "--frame", "tip").twist
    assert twist.linear_m_s.x == pytest.approx(0.01)
    assert twist.angular_rad_s.z == pytest.approx(math.pi)
    assert (twist.frame_id, twist.reference_point) == ("tip", "tip")
    assert not sent("twist", "10", "0", "0").twist.HasField("angular_rad_s")
    assert sent("lengths", "200", "210", "190").lengths.length_m == pytest.approx([0.2, 0.21, 0.19])
    assert sent("pressures", "-0.5", "0.5").pressures.pressure_pa == pytest.approx([-5e4, 5e4])


def test_config_shows_what_loads_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["config", "show", "--arm", "trunk"]) == 0
    path = tmp_path / "own.toml"
    path.write_text(capsys.readouterr().out)
    assert load(path) == load(preset="trunk")
    assert main(["config", "check", str(path)]) == 0
    assert capsys.readouterr().out.startswith(f"{path}: good; arm trunk, 9 chambers, 500 Hz")
    path.write_text("[control]\nrate_hz = 1\n")
    assert main(["config", "check", str(path)]) == 1
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith(f"pneuarm: {path}: control.rate_hz = 1: ")


@pytest.mark.parametrize(
    ("text", "facts"),
    [
        ('[log]\ndirectory = "/etc/passwd"', ("log.directory", "/etc/passwd")),
        ('[rerun]\nbind = "192.0.2.1"', ("rerun.bind", "192.0.2.1", "this machine")),
        ('[zenoh]\nlisten = ["tcp/192.0.2.1:7447"]', ("zenoh.listen", "192.0.2.1", "machine")),
        ('[zenoh]\nlisten = ["tcp/nobody.invalid:7447"]', ("zenoh.listen", "nobody.invalid")),
        ('[zenoh]\nconfig_file = "/none.json5"', ("zenoh.config_file", "/none.json5")),
        ('[feedback]\ntip_pose_key_file = "/none"', ("feedback.tip_pose_key_file", "/none")),
    ],
)
def test_what_this_machine_has_not_is_told_before_a_start(
    text: str, facts: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "own.toml"
    path.write_text(text)
    assert main(["config", "check", str(path)]) == 1
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert all(fact in told for fact in facts)


def test_a_port_that_a_daemon_has_is_no_mistake_of_the_configuration(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        path.write_text(f'[zenoh]\nlisten = ["tcp/127.0.0.1:{port}"]')
        assert main(["config", "check", str(path)]) == 0


def test_info_tells_what_is_in_a_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    session = make_session(tmp_path, monkeypatch)
    session.write_ticks(30)
    session.recorder().finish()
    assert main(["info", str(session.path)]) == 0
    text = capsys.readouterr().out
    assert "(1 part, closed properly)" in text
    assert "ticks     30, missing 0" in text
    assert main(["info", str(session.path), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["ticks"], told["missing_ticks"], told["arm"]) == (30, 0, "paper")
    assert main(["info", str(tmp_path / "none.mcap")]) == 1
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("speed", ["0", "-1", "nan", "inf", "-1e-3"])
def test_a_log_is_not_replayed_at_no_speed(speed: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", "x.mcap", "--speed", speed]) == 2
    told = capsys.readouterr().err
    assert all(fact in told for fact in ("--speed", repr(speed), "above 0"))


@pytest.mark.parametrize("text", ["-1e1", "-.5E+3", "-1.", "-2_0", "-0"])
def test_every_negative_number_is_a_number_and_no_option(text: str) -> None:
    parsed = build_parser().parse_args(["send", "position", text, "20", text])
    assert parsed.values == [float(text), 20.0, float(text)]
    twist = ["send", "twist", "1", "2", "3", "--angular", "0", "0", text, "--frame", "tip"]
    assert build_parser().parse_args(twist).angular == [0.0, 0.0, float(text)]
