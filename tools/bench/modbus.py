"""Modbus TCP exchanges a second, the adapter's against the bare library's, on loopback.

An exchange is one block write of all setpoints and one block read of all inputs. Both clients take
turns in short windows against the same emulated terminal, and the ratio is the median over the
pairs, so that whatever else the machine does hits both alike.

    python -m tools.bench.modbus --json
"""

import argparse
import json
import platform
import statistics
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable

import numpy as np
import pymodbus
from pymodbus.client import ModbusTcpClient

from pneuarm.hardware.festo.terminal_watchdog import TerminalWatchdog
from pneuarm.hardware.festo_cpx.adapter import CpxSettings, FestoCpx
from pneuarm.hardware.festo_cpx.protocol import CpxLayout
from pneuarm.service.configuration.configuration import load

EXCHANGES = 200
LAYOUT = CpxLayout((0, 1, 2))
PRESSURES_PA = np.array([[2e4, -1e4, 1e4]])


def exchange_of_adapter(port: int) -> Callable[[], object]:
    """The adapter: checked command, rounding, read-back of the setpoints, diagnoses."""
    settings = CpxSettings("127.0.0.1", port, 1, 1.0, LAYOUT, TerminalWatchdog(46100, 1, 0))
    adapter = FestoCpx(load(None, "paper").build_arm(), settings)
    adapter.connect()

    def exchange() -> None:
        adapter.write(PRESSURES_PA, 0.0)
        adapter.read(0.0)

    return exchange


def exchange_of_library(port: int) -> Callable[[], object]:
    """The library alone: registers out, registers in."""
    client = ModbusTcpClient("127.0.0.1", port=port, timeout=1.0, retries=0)
    client.connect()  # type: ignore[no-untyped-call]
    address, count = LAYOUT.input_block
    values = [200, 65436, 100]

    def exchange() -> None:
        client.write_registers(LAYOUT.output_base, values)
        client.read_holding_registers(address, count=count)

    return exchange


def rate_per_s(exchange: Callable[[], object], number: int) -> float:
    """Exchanges a second over a window."""
    begin_s = time.perf_counter()
    for _ in range(number):
        exchange()
    return number / (time.perf_counter() - begin_s)


def figures(rounds: int, exchanges: int = EXCHANGES) -> dict[str, object]:
    """All figures as one object."""
    emulator = subprocess.Popen(
        [sys.executable, "-m", "pneuarm", "emulate", "festo-cpx", "--watchdog-ms", "0"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        port = _port(emulator)
        ours, bare = exchange_of_adapter(port), exchange_of_library(port)
        rate_per_s(ours, exchanges // 10 + 1), rate_per_s(bare, exchanges // 10 + 1)
        pairs = [(rate_per_s(ours, exchanges), rate_per_s(bare, exchanges)) for _ in range(rounds)]
    finally:
        emulator.terminate()
        emulator.wait(10)
    return {
        "exchanges_per_s": statistics.median(pair[0] for pair in pairs),
        "library_exchanges_per_s": statistics.median(pair[1] for pair in pairs),
        "share_of_library": statistics.median(mine / theirs for mine, theirs in pairs),
        "rounds": rounds,
        "exchanges_a_round": exchanges,
        "pymodbus": pymodbus.__version__,
        "machine": platform.machine(),
        "python": platform.python_version(),
    }


def _port(emulator: "subprocess.Popen[str]") -> int:
    lines: list[str] = []
    for line in emulator.stdout or ():
        if line.startswith("# faults"):
            break
        lines.append(line)
    port: int = tomllib.loads("".join(lines))["festo_cpx"]["port"]
    return port


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="one JSON object")
    parser.add_argument("--rounds", type=int, default=15)
    arguments = parser.parse_args()
    result = figures(arguments.rounds)
    if arguments.json:
        print(json.dumps(result, indent=2))
    else:
        for name, value in result.items():
            print(f"{name:32} {value}")


if __name__ == "__main__":
    main()
