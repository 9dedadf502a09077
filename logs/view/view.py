"""The live view in Rerun: the same code for a running arm and for a replayed log.

A ``log`` call of Rerun takes 20 to 80 us, a row of ``send_columns`` 1 us: so the series get every
tick, batch by batch, and everything else only the newest tick of a batch. What is unknown (NaN) is
not shown.
"""

import numpy as np
import rerun as rr

from pneuarm.controllers.arm.arm import Arm
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.view.blueprint import blueprint
from pneuarm.logs.view.scene import Scene
from pneuarm.logs.view.series import Series
from pneuarm.logs.view.status import status_markdown

_LEVELS = {
    pb.LEVEL_UNSPECIFIED: rr.TextLogLevel.INFO,
    pb.INFO: rr.TextLogLevel.INFO,
    pb.WARNING: rr.TextLogLevel.WARN,
    pb.ERROR: rr.TextLogLevel.ERROR,
}


class View:
    """Shows the ticks and events of one arm in a Rerun recording.

    The timelines are ``tick`` (sequence number) and ``time`` (UTC of the tick).
    """

    def __init__(self, arm: Arm, recording: rr.RecordingStream) -> None:
        self._arm = arm
        self._recording = recording
        self._scene = Scene(arm, recording)
        self._series = Series(arm, recording)

    def start(self) -> None:
        """Send the layout and what never changes."""
        # When a message reached Rerun says nothing about the arm; in a replay it misleads.
        self._recording.set_log_time_enabled(False)
        self._recording.send_blueprint(blueprint(self._arm))
        self._scene.start()
        self._series.start()

    def ticks(self, ticks: np.ndarray) -> None:
        """Show records of logs/rings/tick.py, shape (n,), oldest first."""
        if not len(ticks):
            return
        newest = ticks[-1]
        self._recording.set_time("tick", sequence=int(newest["sequence"]))
        self._recording.set_time("time", timestamp=newest["time_unix_ns"].astype("datetime64[ns]"))
        self._series.show(ticks)
        self._scene.show(ticks)
        status = rr.TextDocument(status_markdown(newest), media_type=rr.MediaType.MARKDOWN)
        self._recording.log("status", status)

    def event(self, event: pb.Event) -> None:
        """Add an entry to the event log, at the event's own time."""
        self._recording.set_time("time", timestamp=np.datetime64(event.time_unix_ns, "ns"))
        text = rr.TextLog(_line(event), level=_LEVELS[event.level])
        self._recording.log(f"events/{event.source}", text)

    def flush(self) -> None:
        """Wait until everything shown so far has left this process."""
        self._recording.flush()


def _line(event: pb.Event) -> str:
    when = np.datetime64(event.time_unix_ns, "ns").astype("datetime64[ms]").item()
    parts = [f"{when:%H:%M:%S.%f}"[:-3], f"{event.source}: {event.text}"]
    if event.cause:
        parts.append(f"Cause: {event.cause}")
    if event.remedy:
        parts.append(f"Remedy: {event.remedy}")
    return " ".join(parts)
