"""What the live view looks like: the arm large on the left, plots on the right, words below."""

import numpy as np
import rerun.blueprint as rrb
from rerun.blueprint.encodings import TextLogColumn, TimelineColumn

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.controllers.arm.arm import Arm, Array

_WINDOW_S = 10.0
_BACKGROUND = (22, 24, 28)  # dark in a light theme too: a chamber at rest is light grey


def blueprint(arm: Arm) -> rrb.Blueprint:
    """Return the layout for one arm."""
    words = rrb.Horizontal(
        rrb.TextDocumentView(origin="status", name="Status"), _events(), column_shares=[1, 1]
    )
    left = rrb.Vertical(_scene(arm), words, row_shares=[7, 2.3])
    return rrb.Blueprint(
        rrb.Horizontal(left, _plots(arm), column_shares=[3, 2]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline="time", play_state="following"),
    )


def _events() -> rrb.TextLogView:
    # Rerun makes the time column too narrow to be read: the time stands in the text.
    columns = rrb.TextLogColumns(
        timeline_columns=[TimelineColumn("time", visible=False)],
        text_log_columns=[TextLogColumn("loglevel"), TextLogColumn("body")],
    )
    return rrb.TextLogView(origin="events", name="Events", columns=columns)


def _scene(arm: Arm) -> rrb.Spatial3DView:
    return rrb.Spatial3DView(
        origin="scene",
        name=f"{arm.name}: chambers from blue (shortest) to red (longest); cross: target; "
        "dot: tip, cyan true, white measured",
        background=_BACKGROUND,
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=_eye(arm),
    )


def _eye(arm: Arm) -> rrb.EyeControls3D:
    """Look at the middle of the arm from the side, with gravity pointing down."""
    up = -_unit(np.asarray(arm.gravity_m_s2), fallback=(0.0, 0.0, 1.0))
    side = _unit(np.cross(up, [0.0, 0.0, 1.0]), fallback=(1.0, 0.0, 0.0))
    direction = _unit(side + 0.7 * np.cross(side, up) + 0.35 * up, fallback=(1.0, 0.0, 0.0))
    middle_m = np.array([0.0, 0.0, 0.6 * arm.total_rest_length_m])
    return rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=middle_m + 1.3 * arm.max_length_m * direction,
        look_target=middle_m,
        eye_up=up,
    )


def _unit(vector: Array, fallback: tuple[float, float, float]) -> Array:
    norm = float(np.linalg.norm(vector))
    return np.asarray(fallback) if norm < 1e-9 else vector / norm


def _plots(arm: Arm) -> rrb.Vertical:
    error = _plot("tip_error_mm", "Tip to target [mm]")
    timing = _plot("timing_us", "Control loop [us]")
    mode = rrb.StateTimelineView(origin="mode", name="Mode", time_ranges=_window())
    if arm.n_sections == 1:
        rows = [*_section(arm, 1), error, timing]
        return rrb.Vertical(*rows, mode, row_shares=[3, 3, 2.4, 2.4, 1.4])
    numbers = range(1, arm.n_sections + 1)
    pairs = [rrb.Horizontal(*_section(arm, number)) for number in numbers]
    shares = [2.5] * arm.n_sections + [2.4, 1.4]
    return rrb.Vertical(*pairs, rrb.Horizontal(error, timing), mode, row_shares=shares)


def _section(arm: Arm, number: int) -> tuple[rrb.TimeSeriesView, rrb.TimeSeriesView]:
    section, suffix = arm.sections[number - 1], f" {number}" if arm.n_sections > 1 else ""
    low_m, high_m = length_bounds_m(arm)
    lengths = f"{1e3 * low_m[number - 1, 0]:.0f} to {1e3 * high_m[number - 1, 0]:.0f}"
    pressures = f"{1e-5 * section.pressure_min_pa:g} to {1e-5 * section.pressure_max_pa:g}"
    # One legend is enough: a chamber has the same colour everywhere, and the plots are small.
    return (
        _plot(f"length_mm/section{number}", f"Lengths{suffix} [mm], {lengths}", number == 1),
        _plot(f"pressure_bar/section{number}", f"Pressures{suffix} [bar], {pressures}", False),
    )


def _plot(origin: str, name: str, legend: bool = True) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        origin=origin,
        name=name,
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=legend),
        time_ranges=_window(),
    )


def _window() -> rrb.VisibleTimeRanges:
    return rrb.VisibleTimeRanges(
        timeline="time",
        start=rrb.TimeRangeBoundary.cursor_relative(seconds=-_WINDOW_S),
        end=rrb.TimeRangeBoundary.cursor_relative(seconds=0.0),
    )
