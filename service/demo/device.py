"""The emulated device of a show: started beside the daemon, which is told where it is."""

import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pneuarm.controllers.arm.errors import InvalidInput, PneuarmError
from pneuarm.hardware.device import EmulatedDevice
from pneuarm.hardware.simulator.device import SimulatedDevice
from pneuarm.service.configuration.devices import devices
from pneuarm.service.devices.registry import fitting
from pneuarm.service.emulators.command import LAST_LINE
from pneuarm.service.processes.program import start_beside


@contextmanager
def emulated(adapter: str, arm: str, seed: int, valves: str) -> Iterator[dict[str, object]]:
    """Run an emulator while the context lasts; yields its tables of the configuration.

    A simulated arm needs none. Raises PneuarmError where the emulator does not start, and
    NotInstalled where a package is missing.
    """
    device = devices().named(adapter)
    device.require()
    if isinstance(device, SimulatedDevice):
        yield {"hardware": {"adapter": adapter}, device.table: {"seed": seed, "valves": valves}}
        return
    if not isinstance(device, EmulatedDevice):
        raise InvalidInput(f"--adapter {adapter}: this device has no emulator to show")
    configuration = fitting(device, arm)
    with tempfile.TemporaryDirectory(prefix="pneuarm-demo-") as folder:
        path = Path(folder) / "device.toml"
        path.write_text(configuration.to_toml())
        emulator = start_beside(
            [
                *(sys.executable, "-m", "pneuarm", "emulate", adapter),
                *("--arm", str(path), "--seed", str(seed), "--valves", valves),
            ],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            own = {"arm": configuration.arm.model_dump(exclude_none=True)}
            yield _tables(emulator, adapter) | own
        finally:
            emulator.terminate()
            emulator.wait(10)


def _tables(emulator: "subprocess.Popen[str]", adapter: str) -> dict[str, object]:
    """Read the configuration lines that an emulator prints, to the comment that ends them."""
    lines: list[str] = []
    for line in emulator.stdout or ():
        if line.startswith(LAST_LINE):
            return tomllib.loads("".join(lines))
        lines.append(line)
    raise PneuarmError(f"the emulator of {adapter} did not start; see its line above")
