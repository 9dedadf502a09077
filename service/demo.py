"""`pneuarm demo`: the daemon as one process, its client as another, and what came of it."""

import argparse
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import tomli_w

from controllers.errors import DaemonUnreachable, InvalidInput, PneuarmError
from logs.reader import LogReader
from service.client import Client
from service.demo_device import emulated

_START_S = 30.0


@dataclass(frozen=True)
class Figures:
    """What `pneuarm demo --json` prints; latencies in microseconds."""

    ticks: int
    rate_hz: float
    overruns: int
    wake_us: dict[str, float]
    compute_us: dict[str, float]
    missing_records: int
    tip_rms_error_mm: float
    log: str
    log_bytes: int


def demo(arguments: argparse.Namespace) -> int:
    """Run the show and print its table."""
    if not arguments.seconds >= 1.0:
        raise InvalidInput(f"--seconds {arguments.seconds:g}: at least 1 is needed")
    quiet = arguments.json
    with (
        tempfile.TemporaryDirectory(prefix="pneuarm-demo-") as folder,
        emulated(arguments.adapter, arguments.arm, arguments.seed) as device,
    ):
        endpoint = f"tcp/127.0.0.1:{_free_port()}"
        config = Path(folder) / "demo.toml"
        config.write_text(_configuration(arguments, endpoint, device))
        daemon = subprocess.Popen(
            [sys.executable, "-m", "pneuarm", "run", str(config)],
            stdout=sys.stderr if quiet else None,
            start_new_session=True,  # Ctrl-C ends the show first, then the daemon
        )
        try:
            log = _wait_for_daemon(daemon, arguments.arm, endpoint)
            phases = _run_client(arguments, endpoint)
        finally:
            daemon.send_signal(signal.SIGTERM)
            status = daemon.wait(60)
    if status != 0:
        raise PneuarmError(f"the daemon ended with status {status}; see its lines above")
    figures = evaluate(log, phases)
    print(json.dumps(asdict(figures)) if quiet else table(figures))
    return 0


def _configuration(arguments: argparse.Namespace, endpoint: str, device: dict[str, object]) -> str:
    return tomli_w.dumps(
        device
        | {
            "preset": arguments.arm,
            "simulator": {"seed": arguments.seed},
            "zenoh": {"listen": [endpoint]},
            "rerun": {"port": _free_port(), "open_viewer": True},
        }
    )


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


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


def _run_client(arguments: argparse.Namespace, endpoint: str) -> dict[str, list[int]]:
    client = subprocess.run(
        [
            *(sys.executable, "-m", "service.demo_client"),
            *(arguments.arm, endpoint, str(arguments.seconds)),
        ],
        stdout=subprocess.PIPE,
        check=False,
    )
    if client.returncode != 0:
        raise PneuarmError("the demo's client failed; see its lines above")
    phases: dict[str, list[int]] = json.loads(client.stdout)
    return phases


def evaluate(log: Path, phases: dict[str, list[int]]) -> Figures:
    """Read the figures of the show from its log."""
    reader = LogReader(log)
    ticks = reader.ticks()
    numbers = ticks["sequence"]
    span_s = (int(ticks["time_unix_ns"][-1]) - int(ticks["time_unix_ns"][0])) * 1e-9
    # Only a simulated arm knows its true tip; a device's is the estimate.
    known = not np.isnan(ticks["tip_true_position_m"]).all()
    tip = ticks["tip_true_position_m" if known else "tip_estimated_position_m"]
    error = tip - ticks["target_position_m"]
    drawn = np.zeros(len(ticks), dtype=bool)
    for first, last in phases.values():
        drawn |= (numbers >= first) & (numbers <= last)
    square = (error[drawn] ** 2).sum(axis=1)
    return Figures(
        ticks=len(ticks),
        rate_hz=(len(ticks) - 1) / span_s,
        overruns=int(ticks["overruns"][-1]),
        wake_us=_latency(ticks["wake_latency_s"]),
        compute_us=_latency(ticks["compute_s"][1:]),
        missing_records=int(numbers[-1]) - len(np.unique(numbers)),
        tip_rms_error_mm=1e3 * float(np.sqrt(np.nanmean(square))),
        log=str(log),
        log_bytes=sum(part.stat().st_size for part in reader.parts),
    )


def _latency(seconds: np.ndarray) -> dict[str, float]:
    p50, p99 = np.percentile(seconds, (50, 99)) * 1e6
    maximum = float(seconds.max()) * 1e6
    return {"p50": round(p50, 2), "p99": round(p99, 2), "max": round(maximum, 2)}


def table(figures: Figures) -> str:
    """Return the figures for people, and how to see the session again."""
    wake, compute = figures.wake_us, figures.compute_us
    row = "{:18} {:>12}   {}".format
    lines = [
        "",
        row("ticks", figures.ticks, f"{figures.rate_hz:.2f} Hz, {figures.overruns} overruns"),
        row("wake latency", f"{wake['p50']:.1f} us", _tail(wake)),
        row("computing time", f"{compute['p50']:.1f} us", _tail(compute)),
        row("records missing", figures.missing_records, ""),
        row(
            "tip error RMS",
            f"{figures.tip_rms_error_mm:.2f} mm",
            "tip (true; estimated behind a device) against the reference, circle and eight; "
            "uncalibrated, no tip feedback",
        ),
        row("log", f"{figures.log_bytes / 1e6:.1f} MB", figures.log),
        "",
        "see it again:",
        f"  {_program('pneuarm')} replay {figures.log}",
        f"  {_program('rerun')} {figures.log}",
    ]
    return "\n".join(line.rstrip() for line in lines)


def _program(name: str) -> str:
    """Return how to call a program of this environment from here."""
    own = Path(sys.executable).with_name(name)
    found = shutil.which(name)
    if found is not None and Path(found).samefile(own):
        return name
    return os.path.relpath(own)


def _tail(latency: dict[str, float]) -> str:
    return f"median; p99 {latency['p99']:.1f} us, max {latency['max']:.1f} us"
