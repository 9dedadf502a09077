"""Names, colours and widths of the time series; sent once, before any value."""

from collections.abc import Sequence
from typing import Literal

import rerun as rr

from pneuarm.controllers.arm.arm import Arm
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.view import colors as colors

#: Whose distance to the target is plotted: the part of the tick's field name, and the colour.
TIPS: dict[str, colors.Color] = {
    "true": colors.TIP_TRUE,
    "measured": colors.TIP_MEASURED,
    "estimated": colors.TIP_ESTIMATED,
    "commanded": colors.TIP_COMMANDED,
}
_THIN, _LINE, _BAND = 1.0, 1.5, 4.0


class Styles:
    """Sends the styles of all series of an arm."""

    def __init__(self, recording: rr.RecordingStream) -> None:
        self._recording = recording

    def send(self, arm: Arm) -> None:
        """Send everything."""
        for section in range(1, arm.n_sections + 1):
            self._chambers(f"length_mm/section{section}", "estimated")
            self._chambers(f"pressure_bar/section{section}", "measured")
        for tip, color in TIPS.items():
            width = _BAND if tip == "commanded" else _LINE
            self._lines(f"tip_error_mm/{tip}", [f"{tip} tip"], [color], width)
        self._timing()
        self._modes()

    def _chambers(self, plot: str, real: str) -> None:
        # The command is a broad dark band below the thin bright line of what really happens; with
        # the same names they share one entry of the legend.
        names = ["chamber 1", "chamber 2", "chamber 3"]
        self._lines(f"{plot}/commanded", names, colors.CHAMBERS_COMMANDED, _BAND)
        self._lines(f"{plot}/{real}", names, colors.CHAMBERS, _LINE)
        self._lines(f"{plot}/bounds", ["bounds"] * 2, [colors.BOUND] * 2, _THIN)

    def _timing(self) -> None:
        # Of the ticks that share a pixel the slowest is drawn; a mean would hide what matters.
        names, line_colors = ["wake latency", "compute"], [colors.WAKE, colors.COMPUTE]
        self._lines("timing_us/loop", names, line_colors, _LINE, "max")
        overrun = rr.SeriesPoints(
            names="overrun", colors=colors.OVERRUN, markers="cross", marker_sizes=6.0
        )
        self._recording.log("timing_us/overrun", overrun, static=True)

    def _modes(self) -> None:
        names = [pb.Mode.Name(mode) for mode in colors.MODES]
        modes = rr.StateConfiguration(values=names, colors=list(colors.MODES.values()))
        self._recording.log("mode", modes, static=True)

    def _lines(
        self,
        path: str,
        names: list[str],
        line_colors: Sequence[colors.Color],
        width: float,
        of_a_pixel: Literal["average", "max"] = "average",
    ) -> None:
        style = rr.SeriesLines(
            names=names,
            colors=line_colors,
            widths=[width] * len(names),
            aggregation_policy=of_a_pixel,
        )
        self._recording.log(path, style, static=True)
