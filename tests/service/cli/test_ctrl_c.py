"""Ctrl-C while a command still loads its modules ends it without a word."""

import subprocess
import sys

import pytest

from tools.rig.daemon import PATIENCE_S, ROOT

#: Sends the signal to itself just when a module is being looked for.
_PROGRAM = """
import os, runpy, signal, sys

class CtrlC:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, CtrlC())
sys.argv = ["pneuarm", *{arguments!r}]
{start}
"""

_SCRIPT = "from pneuarm.__main__ import main; main()"
_MODULE = "runpy.run_module('pneuarm', run_name='__main__')"


def interrupted(
    module: str, arguments: list[str], start: str
) -> "subprocess.CompletedProcess[str]":
    """Run a command with Ctrl-C at the import of a module."""
    program = _PROGRAM.format(module=module, arguments=arguments, start=start)
    return subprocess.run(
        [sys.executable, "-c", program],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
    )


@pytest.mark.parametrize("start", [_SCRIPT, _MODULE])
@pytest.mark.parametrize(
    ("module", "arguments"),
    [
        ("pneuarm.service.cli.parser", ["state"]),
        ("zenoh", ["state"]),
        ("numpy", ["run"]),
        ("pneuarm.service.demo.demo", ["demo"]),
    ],
)
def test_ctrl_c_while_loading_says_nothing(module: str, arguments: list[str], start: str) -> None:
    done = interrupted(module, arguments, start)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_later_it_is_the_commands_own_affair() -> None:
    """A module that a running command loads is no start: its cleaning up must come to its turn."""
    start = """
from pneuarm.service.cli import client_commands
def state(parsed):
    try:
        def own():
            import tabnanny
        own.__globals__["__name__"] = "pneuarm.service.cli.client_commands"
        own()
    finally:
        print("cleaned up")
import types
name = {"__name__": "pneuarm.service.cli.client_commands"}
client_commands.state = types.FunctionType(state.__code__, name)
from pneuarm.__main__ import main
main()
"""
    done = interrupted("tabnanny", ["state"], start)
    assert (done.returncode, done.stdout, done.stderr) == (130, "cleaned up\n", "")
