"""`pneuarm demo`: the daemon as one process, its client as another, and what came of it.

The simulated arm draws the same figure of eight three times: with the nominal model, calibrated,
and calibrated with its tip measured. All of it is one recording in Rerun. A device, or its
emulator, has one run: its tip is not known.
"""

import argparse
import json
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path

from pneuarm.controllers.arm.errors import DaemonUnreachable, PneuarmError
from pneuarm.service.client.client import Client
from pneuarm.service.configuration.configuration import Configuration, check, load
from pneuarm.service.demo.device import emulated
from pneuarm.service.demo.figures import Drawn, evaluate, table
from pneuarm.service.demo.parts import DemoPart, parts, tables
from pneuarm.service.demo.screen import Screen
from pneuarm.service.processes.program import start_beside

_START_S = 30.0
_END_S = 70.0  # the daemon's own last resort comes after 60 s


def demo(arguments: argparse.Namespace) -> int:
    """Run the show and print its table."""
    with emulated(arguments.adapter, arguments.arm, arguments.seed, arguments.valves) as device:
        configuration = check(_laid_over(arguments, device), "the demo")
        with Screen(configuration) as screen:
            drawn = [
                _play(part, configuration, screen, arguments)
                for part in parts(configuration, arguments.seconds)
            ]
    figures = evaluate(drawn)
    print(json.dumps(asdict(figures)) if arguments.json else table(figures))
    return 0


def _laid_over(arguments: argparse.Namespace, device: dict[str, object]) -> dict[str, object]:
    laid = load(preset=arguments.arm).model_dump(exclude_none=True)
    for above in (device, tables()):
        for name, value in above.items():
            laid[name] = laid[name] | value if isinstance(value, dict) else value
    return laid


def _play(
    part: DemoPart, nominal: Configuration, screen: Screen, arguments: argparse.Namespace
) -> Drawn:
    """Run one daemon and its client; return where the part's records are."""
    configuration = part.configuration()
    endpoint = configuration.zenoh.listen[0]
    with tempfile.TemporaryDirectory(prefix="pneuarm-demo-") as folder:
        path = Path(folder) / "demo.toml"
        path.write_text(configuration.to_toml())
        with _daemon(path, arguments.json) as daemon:
            log = _wait_for_daemon(daemon, arguments.arm, endpoint)
            screen.caption(part.caption)
            with _camera(part, arguments.arm, endpoint):
                phases = _run_client(part, nominal, endpoint)
    return Drawn(part.name, log, phases)


@contextmanager
def _daemon(config: Path, quiet: bool) -> "Iterator[subprocess.Popen[bytes]]":
    command = [sys.executable, "-m", "pneuarm", "run", str(config)]
    daemon = start_beside(command, stdout=sys.stderr if quiet else None)
    try:
        yield daemon
    finally:
        daemon.send_signal(signal.SIGTERM)
        status = daemon.wait(_END_S)
    if status != 0:
        raise PneuarmError(f"the daemon ended with status {status}; see its lines above")


def _wait_for_daemon(daemon: "subprocess.Popen[bytes]", arm: str, endpoint: str) -> Path:
    """Wait until the daemon answers; return the path of its log."""
    give_up_s = time.monotonic() + _START_S
    while True:
        if daemon.poll() is not None:
            raise PneuarmError("the daemon did not start; see its line above")
        try:
            with Client(arm, endpoint, "demo") as client:
                return Path(client.info().log_path)
        except DaemonUnreachable:
            if time.monotonic() > give_up_s:
                raise
            time.sleep(0.1)


@contextmanager
def _camera(part: DemoPart, arm: str, endpoint: str) -> Iterator[None]:
    """Let a simulated motion capture see the tip, where the part has one."""
    if not part.camera:
        yield
        return
    command = [sys.executable, "-m", "pneuarm", "emulate", "camera"]
    command += ["--arm", arm, "--connect", endpoint]
    camera = start_beside(command, stdout=subprocess.DEVNULL)
    try:
        yield
    finally:
        camera.terminate()
        camera.wait(10)


def _run_client(part: DemoPart, nominal: Configuration, endpoint: str) -> dict[str, list[int]]:
    """Let the client draw; the size of the figures is that of the nominal arm in every part."""
    client = subprocess.run(
        [
            *(sys.executable, "-m", "pneuarm.service.demo.client", nominal.arm.name, endpoint),
            json.dumps({"label": part.name, "camera": part.camera, "seconds": part.seconds}),
        ],
        stdout=subprocess.PIPE,
        input=nominal.to_toml().encode(),
        check=False,
    )
    if client.returncode != 0:
        raise PneuarmError("the demo's client failed; see its lines above")
    phases: dict[str, list[int]] = json.loads(client.stdout)
    return phases
