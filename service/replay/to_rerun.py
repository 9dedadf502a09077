"""A recorded session in Rerun: the same scene by the same code as the live view."""

import time
from itertools import count

import rerun as rr

from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.reading.replay import paced
from pneuarm.logs.rings.tick import ticks_from_states
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.view.view import View
from pneuarm.service.configuration.configuration import Configuration, rerun_url
from pneuarm.service.daemon.viewer import has_display, open_viewer, start_server
from pneuarm.service.network.endpoint import in_url
from pneuarm.service.network.sessions import check_free
from pneuarm.service.replay.telling import say, say_damage

#: The view gets ticks in batches of this many seconds, as the live one does.
_BATCH_S = 1.0 / 30.0


def replay_in_rerun(
    reader: LogReader, configuration: Configuration, speed: float, loop: bool
) -> int:
    """Serve the log to Rerun; with a display its window opens. Goes on until Ctrl-C."""
    bind, port = configuration.rerun.bind, configuration.rerun.port
    check_free("--port", f"tcp/{in_url(bind)}:{port}")
    server = start_server(configuration)
    try:
        url = rerun_url(configuration)
        if has_display():
            open_viewer(url)
        print(f"replaying {reader.parts[0]} at speed {speed:g}; see it with: rerun --connect {url}")
        for number in count(1):
            _round(reader, configuration, speed, number)
            say_damage(reader)
            if not loop:
                break
        print("the end of the log; the scene stays until Ctrl-C", flush=True)
        while server.poll() is None:
            time.sleep(0.2)
    finally:
        server.terminate()
    return 0


def _round(reader: LogReader, configuration: Configuration, speed: float, number: int) -> None:
    """Show the whole log once, as a recording of its own."""
    name = f"replay-{reader.parts[0].stem}-{number}"
    recording = rr.RecordingStream(f"pneuarm_{configuration.arm.name}", recording_id=name)
    recording.connect_grpc(rerun_url(configuration))
    view = View(configuration.build_arm(), recording)
    view.start()
    _show(reader, view, speed)
    recording.flush()
    recording.disconnect()


def _show(reader: LogReader, view: View, speed: float) -> None:
    batch: list[pb.ArmState] = []
    shown_s = time.monotonic()
    for entry in paced(reader, speed, False, time.monotonic, time.sleep, say):
        if isinstance(entry.message, pb.Event):
            view.event(entry.message)
        elif isinstance(entry.message, pb.ArmState):
            batch.append(entry.message)
        if batch and time.monotonic() - shown_s >= _BATCH_S:
            shown_s = time.monotonic()
            view.ticks(ticks_from_states(batch, reader.n_sections))
            batch.clear()
    if batch:
        view.ticks(ticks_from_states(batch, reader.n_sections))
