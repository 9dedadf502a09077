"""Ctrl-C, or another order to end, while a command still loads its modules ends it without a word.

Later it is an exception, and what was begun is ended in its order.
"""

import signal
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
            os.kill(os.getpid(), {number})

sys.meta_path.insert(0, CtrlC())
sys.argv = ["pneuarm", *{arguments!r}]
{start}
"""

#: `nohup` ignores SIGHUP, and so does what the tests start.
ENDING = [
    number
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    if signal.getsignal(number) != signal.SIG_IGN
]

_SCRIPT = "from pneuarm.__main__ import main; main()"
_MODULE = "runpy.run_module('pneuarm', run_name='__main__')"


def interrupted(
    module: str, arguments: list[str], start: str, number: int
) -> "subprocess.CompletedProcess[str]":
    """Run a command that gets a signal at the import of a module."""
    program = _PROGRAM.format(module=module, arguments=arguments, start=start, number=int(number))
    return subprocess.run(
        [sys.executable, "-c", program],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
    )


@pytest.mark.parametrize("number", ENDING)
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
def test_an_order_to_end_while_loading_is_obeyed_without_a_word(
    module: str, arguments: list[str], start: str, number: int
) -> None:
    done = interrupted(module, arguments, start, number)
    assert (done.returncode, done.stdout, done.stderr) == (128 + number, "", "")


@pytest.mark.parametrize("number", ENDING)
def test_later_it_is_the_commands_own_affair(number: int) -> None:
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
    done = interrupted("tabnanny", ["state"], start, number)
    assert (done.returncode, done.stdout, done.stderr) == (128 + number, "cleaned up\n", "")
