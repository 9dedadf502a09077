"""The parts of the show: what each daemon is told, and what its client draws."""

import socket
import sys
from collections.abc import Callable
from dataclasses import dataclass

from pneuarm.service.calibration.simulated import calibrate_simulated
from pneuarm.service.configuration.configuration import Configuration


@dataclass(frozen=True)
class DemoPart:
    """One daemon's run. ``seconds`` says how long each phase lasts; ``camera``: the tip is seen."""

    name: str
    caption: str
    configuration: Callable[[], Configuration]
    camera: bool
    seconds: dict[str, float]


def tables() -> dict[str, object]:
    """Tables of the configuration that every part shares: free ports, one Rerun recording.

    The client of a show may be late on a busy machine: nobody stands beside the arm.
    """
    return {
        "control": {"target_timeout_ms": 2000.0},
        "zenoh": {"listen": [f"tcp/127.0.0.1:{_free_port()}"]},
        "rerun": {"port": _free_port(), "start_server": False, "recording": "pneuarm-demo"},
    }


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def parts(configuration: Configuration, seconds: float) -> list[DemoPart]:
    """Return what is shown in about ``seconds`` of drawing."""
    if not configuration.is_simulated:
        whole = {"circle": 0.45 * seconds, "eight": 0.45 * seconds, "out of reach": 1.0}
        caption = "through the emulated device: its true tip is not known"
        return [DemoPart("device", caption, lambda: configuration, False, whole)]
    found: list[Configuration] = []

    def calibrated() -> Configuration:
        if not found:
            print("calibrating the simulated arm in simulated time ...", file=sys.stderr)
            found.append(calibrate_simulated(configuration))
        return found[0]

    eight = {"eight": 0.25 * seconds}
    return [
        DemoPart("uncalibrated", "1 uncalibrated", lambda: configuration, False, eight),
        DemoPart("calibrated", "2 calibrated", calibrated, False, eight),
        DemoPart(
            "feedback",
            "3 calibrated, tip measured",
            calibrated,
            True,
            {"circle": 0.2 * seconds, "eight": 0.25 * seconds, "out of reach": 1.0},
        ),
    ]
