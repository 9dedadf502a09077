"""The viewer process: the newest ticks to Rerun, at the rate of a screen.

It may stall and may be stopped: nothing else notices, and what it did not show is counted.
"""

import os
import signal
import subprocess
import sys
import time
from importlib.util import find_spec
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
import rerun as rr

from pneuarm.controllers.arm.errors import ConfigurationError, PneuarmError
from pneuarm.logs.rings.ring import RingReader
from pneuarm.logs.rings.rings import MessageReader
from pneuarm.logs.rings.tick import tick_dtype
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.topics import EVENT
from pneuarm.logs.view.view import View
from pneuarm.service.configuration.configuration import Configuration, rerun_url
from pneuarm.service.processes import realtime
from pneuarm.service.processes.last_resort import sentence
from pneuarm.service.processes.program import start_beside
from pneuarm.service.processes.shared import (
    Shared,
    end_with_parent,
    ignore_terminal_signals,
    parent_is_alive,
)

_PERIOD_S = 1.0 / 30.0

#: More than this behind (s) is not caught up but skipped.
_CATCH_UP_S = 3.0

#: After standing still for this long (s), the server may have dropped the connection.
_STALLED_S = 5.0

#: Without a supervisor: a viewer that stalls would block this process without end.
_ORPHAN_S = 3.0


def start_server(configuration: Configuration) -> "subprocess.Popen[bytes]":
    """Start Rerun's server as its own process; in the library it would listen everywhere."""
    rerun = configuration.rerun
    return start_beside(
        [
            *(_rerun_program(), "--serve-grpc"),
            *("--bind", rerun.bind, "--port", str(rerun.port)),
            *("--server-memory-limit", f"{rerun.memory_limit_mib}MiB"),
        ],
        ending=signal.SIGKILL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def _rerun_program() -> str:
    """Path of Rerun's own program; its Python wrapper would outlive a kill as an orphan."""
    spec = find_spec("rerun_cli")
    if spec is None or spec.origin is None:
        raise ConfigurationError("rerun.enabled = true, but rerun-sdk is not installed")
    return str(Path(spec.origin).with_name("rerun"))


def has_display() -> bool:
    """Whether a window could be opened here."""
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def open_viewer(url: str) -> None:
    """Open Rerun's own window on the live view, and leave it to its user."""
    subprocess.Popen(
        [_rerun_program(), "--connect", url],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


class ViewerLost(PneuarmError):
    """The live view ended by itself; it is started anew."""


class Viewing:
    """Feeds the view from the rings."""

    def __init__(self, shared: Shared, view: View) -> None:
        self._shared, self._view = shared, view
        self._dtype = tick_dtype(len(shared.configuration.arm.sections))
        self._ticks = RingReader(shared.rings.ticks)
        self._skipped = 0
        self._events = MessageReader(shared.rings.messages())
        self._most = int(_CATCH_UP_S * shared.configuration.control.rate_hz)

    def step(self) -> None:
        """Show what is new, or the newest part of it."""
        self._skipped += self._ticks.skip_to(self._ticks.head() - self._most)
        records = [record for _, record in self._ticks.read(self._most)]
        if records:
            self._view.ticks(np.frombuffer(b"".join(records), self._dtype))
        for topic, payload, _ in self._events.read():
            if topic is EVENT:
                self._view.event(pb.Event.FromString(payload))
        self._shared.viewer.publish(self._skipped + self._ticks.missed)


def main(shared: Shared, end: Connection) -> None:
    """Entry point of the process."""
    ignore_terminal_signals()
    end_with_parent(_ORPHAN_S)
    realtime.step_back(10)
    configuration = shared.configuration
    server = start_server(configuration) if configuration.rerun.start_server else None
    if server is not None:
        shared.processes.started("rerun", server.pid)
    status = 0
    try:
        _run(shared, end, server)
    except Exception as error:
        print(f"ERROR      viewer: {sentence(error)}", file=sys.stderr, flush=True)
        status = 1
    finally:
        if server is not None:
            server.terminate()
        os._exit(status)  # Rerun would wait for a server that is gone


def _run(shared: Shared, end: Connection, server: "subprocess.Popen[bytes] | None") -> None:
    """Show until told to end. If its own server ends the viewer ends too, to be started anew."""
    configuration = shared.configuration
    recording = _recording(shared)
    recording.connect_grpc(rerun_url(configuration))
    view = View(configuration.build_arm(), recording)
    view.start()
    if configuration.rerun.open_viewer and has_display():
        open_viewer(rerun_url(configuration))
    viewing, stepped_s = Viewing(shared, view), time.monotonic()
    while not end.poll(_PERIOD_S) and parent_is_alive():
        if server is not None and server.poll() is not None:
            raise ViewerLost(f"Rerun's server ended with status {server.returncode}")
        if time.monotonic() - stepped_s > _STALLED_S:
            # The server has what was sent; another stream, or the layout again, keeps its threads.
            recording.connect_grpc(rerun_url(configuration))
        stepped_s = time.monotonic()
        viewing.step()
    recording.flush(timeout_sec=1.0)
    recording.disconnect()


def _recording(shared: Shared) -> rr.RecordingStream:
    configuration = shared.configuration
    name = configuration.rerun.recording or shared.session
    return rr.RecordingStream(f"pneuarm_{configuration.arm.name}", recording_id=name)
