"""What the show has in Rerun besides the arm: a server that outlives its daemons, captions."""

import time

import numpy as np
import rerun as rr

from pneuarm.service.configuration.configuration import Configuration, rerun_url
from pneuarm.service.daemon.viewer import has_display, open_viewer, start_server

#: Below the base plate, m.
_PLACE_M = (0.0, 0.0, -0.06)


class Screen:
    """Rerun's server for the whole show; its window where there is a display."""

    def __init__(self, configuration: Configuration) -> None:
        self._configuration = configuration
        name = f"pneuarm_{configuration.arm.name}"
        recording_id = configuration.rerun.recording
        self._recording = rr.RecordingStream(name, recording_id=recording_id)

    def __enter__(self) -> "Screen":
        """Start the server, connect, open the window."""
        self._server = start_server(self._configuration)
        url = rerun_url(self._configuration)
        self._recording.connect_grpc(url)
        if has_display():
            open_viewer(url)
        return self

    def __exit__(self, *error: object) -> None:
        """End the server."""
        self._recording.flush(timeout_sec=1.0)
        self._recording.disconnect()
        self._server.terminate()

    def caption(self, text: str) -> None:
        """Say from now on which part is shown, in the scene and among the events."""
        self._recording.set_time("time", timestamp=np.datetime64(time.time_ns(), "ns"))
        label = rr.Points3D([_PLACE_M], radii=1e-4, labels=[text], show_labels=True)
        self._recording.log("scene/part", label)
        self._recording.log("events/demo", rr.TextLog(text, level=rr.TextLogLevel.INFO))
