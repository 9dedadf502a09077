"""Every argument of every command, with every kind of wrong value: one sentence, never more."""

import argparse
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from pneuarm.service.cli.parser import build_parser, main

#: What no argument takes, whatever it stands for, beside what its own kind refuses.
NUMBERS = [
    "",
    "x",
    "nan",
    "inf",
    "-inf",
    "1e999",
    "9" * 6000,
    "0x10",
    "٣x",
    "\x1b[2J",
]
TEXTS = ["", "\udcff", "a\nb", "\x1b[2J", "a\0b", "9" * 6000, "é" * 300, "/", "*", "-"]


def commands(
    parser: argparse.ArgumentParser, words: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], list[argparse.Action]]]:
    """Yield every command with its arguments."""
    for complete in (["--help"],):  # lets `emulate` and `demo` add what their devices take
        with pytest.raises(SystemExit):
            parser.parse_args(complete)
    subparsers = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    if not subparsers:
        yield words, [a for a in parser._actions if not isinstance(a, argparse._HelpAction)]
    for action in subparsers:
        for name, child in action.choices.items():
            yield from commands(child, (*words, name))


@pytest.fixture
def places(tmp_path: Path) -> list[str]:
    """Paths that are no file that a command could use."""
    os.mkfifo(tmp_path / "fifo")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    (tmp_path / "binary").write_bytes(b"\xff\xfe\0\x01" * 100)
    (tmp_path / "empty").write_text("")
    (tmp_path / "digits.toml").write_text("[control]\nrate_hz = " + "9" * 6000)
    names = ["", "fifo", "loop", "binary", "digits.toml", "empty/under", "none", "x" * 300]
    return [str(tmp_path / name) for name in names] + ["/dev/null", "/dev/full"]


def needed(action: argparse.Action) -> list[str]:
    """Words that satisfy an argument, so that only the one under test is wrong."""
    value = next(iter(action.choices)) if action.choices else "1"
    count = action.nargs if isinstance(action.nargs, int) else 0 if action.nargs == 0 else 1
    return [*action.option_strings[:1], *([value] * count)]


def test_every_argument_refuses_in_one_sentence(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, places: list[str]
) -> None:
    """What is no number is refused by the parser; what it lets through is checked further on."""
    monkeypatch.setattr("pneuarm.service.cli.parser._call", lambda where, arguments: 0)
    tried = 0
    every = list(commands(build_parser()))
    capsys.readouterr()  # the help of each
    for words, actions in every:
        for action in actions:
            wrong = NUMBERS if action.type not in (None, Path) else []
            if action.choices:
                wrong = [*TEXTS, "nobody"]
            if action.type is Path:
                wrong = ["", "a\0b"]
            rest = [
                word
                for other in actions
                if other is not action and (other.required or not other.option_strings)
                for word in needed(other)
            ]
            for value in wrong:
                count = action.nargs if isinstance(action.nargs, int) else 1
                name = action.option_strings[-1:]
                given = [f"{name[0]}={value}"] if name and count == 1 else [*name, *[value] * count]
                status = main([*words, *rest, *given])
                told = capsys.readouterr()
                assert status == 2, (words, given, told.err)
                assert_one_line(told, words, given)
                tried += 1
    assert tried > 300


def assert_one_line(told: "pytest.CaptureResult[str]", *what: object) -> None:
    assert told.out == "", what
    assert told.err.startswith("pneuarm: "), (what, told.err)
    assert told.err.count("\n") == 1, (what, told.err)
    assert told.err[:-1].isprintable(), (what, told.err)
    assert len(told.err) < 1500, what
    assert "Traceback" not in told.err
    assert "bug of pneuarm" not in told.err, (what, told.err)


READS_A_FILE = [
    ("config", "check"),
    ("config", "show"),
    ("run",),
    ("systemd",),
    ("info",),
    ("replay",),
    ("replay", "--to", "zenoh"),
    ("validate", "table1", "--table"),
    ("send", "trajectory"),
    ("emulate", "esp32", "--arm"),
    ("emulate", "ctrl-p", "--record"),
    ("calibrate", "--from"),
    ("learn",),
]


@pytest.mark.parametrize("words", READS_A_FILE, ids=" ".join)
def test_what_is_no_file_of_its_kind_is_named(
    words: tuple[str, ...],
    places: list[str],
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    may_be_made = ("none", "binary", "digits.toml")
    for place in places:
        if "--record" in words and place.endswith(may_be_made):
            continue
        assert main([*words, place]) == 1, place
        told = capsys.readouterr()
        assert_one_line(told, words, place)
        assert place[-20:] in told.err or "..." in told.err, (words, place, told.err)


@pytest.mark.parametrize("option", ["--connect", "--arm", "--zenoh-config"])
@pytest.mark.parametrize("value", ["x", *TEXTS], ids=lambda text: ascii(text)[:20])
@pytest.mark.parametrize("command", ["estop", "hold"])
def test_where_the_daemon_is_may_be_mistyped(
    command: str, option: str, value: str, capsys: pytest.CaptureFixture[str]
) -> None:
    if option == "--zenoh-config" and not value:
        return  # none is what is usual
    words = [command, f"{option}={value}"]
    if option != "--connect":
        words.append("--connect=tcp/127.0.0.1:1")
    if option != "--arm":
        words.append(
            f"--arm=nobody{os.getpid()}"
        )  # an arm that runs on this machine would be stopped
    assert main(words) == 1
    told = capsys.readouterr()
    assert_one_line(told, words)
    if command == "estop":
        assert "NOT CONFIRMED" in told.err
        assert "cut the air supply" in told.err


@pytest.mark.parametrize(
    ("words", "stops"),
    [
        (["--json", "estop"], True),
        (["--", "estop"], True),
        (["ESTOP"], True),
        (["e-stop"], True),
        (["stop"], True),
        (["inform", "estop"], False),
        ([], False),
    ],
)
def test_a_mistyped_stop_is_not_confirmed(
    words: list[str], stops: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == 2
    told = capsys.readouterr().err
    assert ("NOT CONFIRMED" in told and "cut the air supply" in told) == stops
