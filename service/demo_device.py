"""The emulated device of a show: started beside the daemon, which is told where it is."""

import subprocess
import sys
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager

from controllers.errors import PneuarmError


@contextmanager
def emulated(adapter: str, arm: str, seed: int) -> Iterator[dict[str, object]]:
    """Run an emulator while the context lasts; yields its tables of the configuration.

    The simulator needs none. Raises PneuarmError where the emulator does not start.
    """
    if adapter == "simulator":
        yield {}
        return
    emulator = subprocess.Popen(
        [
            *(sys.executable, "-m", "pneuarm", "emulate", adapter),
            *("--arm", arm, "--seed", str(seed)),
        ],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,  # Ctrl-C ends the show first, then what it runs on
    )
    try:
        yield _tables(emulator, adapter)
    finally:
        emulator.terminate()
        emulator.wait(10)


def _tables(emulator: "subprocess.Popen[str]", adapter: str) -> dict[str, object]:
    """Read the configuration lines that an emulator prints, to the comment that ends them."""
    lines: list[str] = []
    for line in emulator.stdout or ():
        if line.startswith("# faults"):
            return tomllib.loads("".join(lines))
        lines.append(line)
    raise PneuarmError(f"the emulator of {adapter} did not start; see its line above")
