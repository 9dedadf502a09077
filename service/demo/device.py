"""The emulated device of a show: started beside the daemon, which is told where it is."""

import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pneuarm.controllers.arm.errors import PneuarmError
from pneuarm.service.configuration.configuration import Configuration, check, load

#: What a section needs where a device cannot move a built-in arm: an ESP32's pump gives 0.13 bar,
#: so its chambers are soft enough to lengthen as far under less.
_SECTIONS: dict[str, dict[str, float]] = {
    "esp32": {
        "pressure_min_bar": 0.0,
        "pressure_max_bar": 0.12,
        "pressure_slew_max_bar_s": 0.6,
        "lengthening_mm_per_bar": 500.0,
        "softening_mm_per_bar2": 0.0,
    }
}


@contextmanager
def emulated(adapter: str, arm: str, seed: int) -> Iterator[dict[str, object]]:
    """Run an emulator while the context lasts; yields its tables of the configuration.

    The simulator needs none. Raises PneuarmError where the emulator does not start.
    """
    if adapter == "simulator":
        yield {}
        return
    configuration = fitting(adapter, arm)
    with tempfile.TemporaryDirectory(prefix="pneuarm-demo-") as folder:
        path = Path(folder) / "device.toml"
        path.write_text(configuration.to_toml())
        emulator = subprocess.Popen(
            [
                *(sys.executable, "-m", "pneuarm", "emulate", adapter),
                *("--arm", str(path), "--seed", str(seed)),
            ],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,  # Ctrl-C ends the show first, then what it runs on
        )
        try:
            own = {"arm": configuration.arm.model_dump(exclude_none=True)}
            yield _tables(emulator, adapter) | own
        finally:
            emulator.terminate()
            emulator.wait(10)


def fitting(adapter: str, arm: str) -> Configuration:
    """Return a built-in arm, or where the device cannot move it, one of its size that it can."""
    tables = load(preset=arm).model_dump(exclude_none=True)
    own = _SECTIONS.get(adapter, {})
    tables["arm"]["sections"] = [section | own for section in tables["arm"]["sections"]]
    return check(tables, f"the arm for {adapter}")


def _tables(emulator: "subprocess.Popen[str]", adapter: str) -> dict[str, object]:
    """Read the configuration lines that an emulator prints, to the comment that ends them."""
    lines: list[str] = []
    for line in emulator.stdout or ():
        if line.startswith("# faults"):
            return tomllib.loads("".join(lines))
        lines.append(line)
    raise PneuarmError(f"the emulator of {adapter} did not start; see its line above")
