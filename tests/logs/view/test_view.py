"""The live view, through what a real recording holds after it was written and read back."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
from rerun.chunk import RrdReader, StoreEntry

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.kinematics.constant_curvature import tip_transform
from pneuarm.logs.rings.tick import new_tick
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.view.colors import LengthColors
from pneuarm.logs.view.trail import TRAIL_NS, Trail
from pneuarm.logs.view.view import View
from tools.rig.arms import paper_arm, table1_arm, trunk_arm

START_NS = 1_760_000_000_000_000_000
Rows = dict[tuple[str, str], list[Any]]
Show = Callable[[View], None]

both = pytest.mark.parametrize("arm", [paper_arm(), trunk_arm()], ids=["one", "three"])


@pytest.fixture(autouse=True)
def _rerun_raises() -> Any:
    """Without strict mode Rerun turns an error of ours into a warning."""
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


def make_ticks(arm: Arm, n: int) -> np.ndarray:
    """Ticks (n,) at 1 kHz of an arm at rest with no target, everything else known."""
    ticks = np.repeat(new_tick(arm.n_sections)[None], n)
    ticks["sequence"] = np.arange(1, n + 1)
    ticks["time_unix_ns"] = START_NS + 1_000_000 * np.arange(n)
    ticks["mode"] = pb.ACTIVE
    ramp = np.linspace(0.0, 1.0, n)[:, None, None]
    steps_m = 1e-3 * np.arange(arm.n_chambers).reshape(arm.n_sections, 3)
    for name in ("length_commanded_m", "length_estimated_m"):
        ticks[name] = arm.rest_lengths_m + ramp * steps_m
    for name in ("pressure_commanded_pa", "pressure_measured_pa"):
        ticks[name] = 1e4 * (ramp + steps_m)
    for name in ("commanded", "estimated"):
        ticks[f"tip_{name}_position_m"] = tip_transform(arm, ticks[f"length_{name}_m"])[:, :3, 3]
    ticks["tip_estimated_orientation_xyzw"] = [0.0, 0.0, 0.0, 1.0]
    return ticks


def recorded(path: Path, arm: Arm, show: Show, blueprint: bool = False) -> Rows:
    """Rows by entity and component, in the order of the tick timeline where there is one."""
    recording = rr.RecordingStream("test_view")
    recording.save(path)
    view = View(arm, recording)
    view.start()
    show(view)
    view.flush()
    recording.disconnect()
    reader = RrdReader(path)
    return _rows(reader, reader.blueprints()[0] if blueprint else reader.recordings()[0])


def _rows(reader: RrdReader, store: StoreEntry) -> Rows:
    timed: dict[tuple[str, str], list[tuple[int, Any]]] = {}
    for chunk in reader.stream(store=store):
        batch = chunk.to_record_batch()
        names = batch.schema.names
        ticks = batch.column("tick").to_pylist() if "tick" in names else [0] * batch.num_rows
        for name in (name for name in names if ":" in name or name == "tick"):
            values = zip(ticks, batch.column(name).to_pylist(), strict=True)
            key = (chunk.entity_path, name)
            timed.setdefault(key, []).extend(row for row in values if row[1] is not None)
    return {
        key: [v for _, v in sorted(rows, key=lambda row: row[0])] for key, rows in timed.items()
    }


def scalars(rows: Rows, path: str) -> Array:
    """Rows (n, k) of a series."""
    return np.array(rows[path, "Scalars:scalars"])


def rgb(rows: Rows, path: str, component: str) -> list[list[int]]:
    """Colours of the newest row, (n, 3)."""
    return [list(int(c).to_bytes(4, "big")[:3]) for c in rows[path, component][-1]]


@both
def test_every_tick_of_every_batch_is_in_every_series(arm: Arm, tmp_path: Path) -> None:
    ticks = make_ticks(arm, 100)

    def show(view: View) -> None:
        for first, end in ((0, 33), (33, 34), (34, 34), (34, 100)):
            view.ticks(ticks[first:end])

    rows = recorded(tmp_path / "a.rrd", arm, show)
    for section in range(arm.n_sections):
        for path, field, factor in (
            ("length_mm/section{}/commanded", "length_commanded_m", 1e3),
            ("length_mm/section{}/estimated", "length_estimated_m", 1e3),
            ("pressure_bar/section{}/commanded", "pressure_commanded_pa", 1e-5),
            ("pressure_bar/section{}/measured", "pressure_measured_pa", 1e-5),
        ):
            values = scalars(rows, "/" + path.format(section + 1))
            np.testing.assert_allclose(values, factor * ticks[field][:, section], rtol=1e-12)
    assert rows["/timing_us/loop", "tick"] == list(range(1, 101))


def test_tick_and_time_are_the_only_timelines(tmp_path: Path) -> None:
    arm = paper_arm()
    ticks = make_ticks(arm, 3)
    ticks["target_position_m"] = [0.0, 0.0, 0.2]

    def show(view: View) -> None:
        view.ticks(ticks)
        view.event(pb.Event(time_unix_ns=START_NS, source="control", text="active"))

    recorded(tmp_path / "a.rrd", arm, show)
    chunks = [chunk for chunk in RrdReader(tmp_path / "a.rrd").stream() if not chunk.is_static]
    assert len(chunks) > 10
    assert all(sorted(chunk.timeline_names) == ["tick", "time"] for chunk in chunks)
    newest = next(chunk for chunk in chunks if chunk.entity_path == "/scene/tip").to_record_batch()
    assert newest.column("tick").to_pylist() == [3]
    assert newest.column("time").cast("int64").to_pylist() == [START_NS + 2_000_000]


@both
def test_chamber_colours_are_the_same_in_every_plot(arm: Arm, tmp_path: Path) -> None:
    rows = recorded(tmp_path / "a.rrd", arm, lambda view: view.ticks(make_ticks(arm, 2)))
    of_marks = rgb(rows, "/scene/arm/skeleton", "Points3D:colors")
    for section in range(arm.n_sections):
        for path in ("length_mm/section{}/estimated", "pressure_bar/section{}/measured"):
            of_plot = rgb(rows, "/" + path.format(section + 1), "SeriesLines:colors")
            assert of_plot == of_marks[3 * section : 3 * section + 3]
            assert len({tuple(color) for color in of_plot}) == 3


@both
def test_bounds_are_plotted(arm: Arm, tmp_path: Path) -> None:
    rows = recorded(tmp_path / "a.rrd", arm, lambda view: view.ticks(make_ticks(arm, 5)))
    low_m, high_m = length_bounds_m(arm)
    for section in range(arm.n_sections):
        bounds = scalars(rows, f"/length_mm/section{section + 1}/bounds")
        np.testing.assert_allclose(bounds, [[1e3 * low_m[section, 0], 1e3 * high_m[section, 0]]])
        bounds = scalars(rows, f"/pressure_bar/section{section + 1}/bounds")
        np.testing.assert_allclose(bounds, [[-0.9, 0.9]])


@both
def test_curves_are_as_long_as_the_chambers(arm: Arm, tmp_path: Path) -> None:
    ticks = make_ticks(arm, 10)
    rows = recorded(tmp_path / "a.rrd", arm, lambda view: view.ticks(ticks))
    (strips,) = rows["/scene/arm/chambers", "LineStrips3D:strips"]
    pieces = np.linalg.norm(np.diff(np.array(strips), axis=1), axis=2)
    expected = ticks["length_estimated_m"][-1].reshape(-1)
    np.testing.assert_allclose(pieces.sum(axis=1), expected, rtol=1e-3)
    (skeleton,) = rows["/scene/arm/skeleton", "LineStrips3D:strips"]
    assert len(skeleton) == 1 + arm.n_sections
    np.testing.assert_allclose(skeleton[0][-1], ticks["tip_estimated_position_m"][-1], atol=1e-6)


@both
def test_a_chamber_at_its_bound_has_another_colour_than_at_rest(arm: Arm, tmp_path: Path) -> None:
    low_m, high_m = length_bounds_m(arm)
    colors = {}
    for name, lengths_m in (("low", low_m), ("rest", arm.rest_lengths_m), ("high", high_m)):
        ticks = make_ticks(arm, 1)
        ticks["length_estimated_m"] = lengths_m
        path = tmp_path / f"{name}.rrd"
        rows = recorded(path, arm, lambda view, ticks=ticks: view.ticks(ticks))  # type: ignore[misc]
        colors[name] = rgb(rows, "/scene/arm/chambers", "LineStrips3D:colors")
    for low, rest, high in zip(colors["low"], colors["rest"], colors["high"], strict=True):
        assert max(rest) - min(rest) == 0  # grey
        assert low[2] > low[0] + 100  # blue
        assert high[0] > high[2] + 100  # red


def test_without_vacuum_rest_is_grey_and_only_shorter_is_blue() -> None:
    arm = table1_arm()
    colors = LengthColors(arm)
    assert colors.of(arm.rest_lengths_m).tolist() == [[225, 225, 225]] * 3
    red, _, blue = colors.of(arm.rest_lengths_m - 1e-3)[0].tolist()
    assert blue > red + 100


def test_what_is_not_known_is_not_recorded(tmp_path: Path) -> None:
    arm = paper_arm()
    ticks = make_ticks(arm, 10)
    ticks["length_commanded_m"] = np.nan
    rows = recorded(tmp_path / "a.rrd", arm, lambda view: view.ticks(ticks))
    assert ("/length_mm/section1/estimated", "Scalars:scalars") in rows
    assert ("/length_mm/section1/commanded", "Scalars:scalars") not in rows
    assert ("/tip_error_mm/estimated", "Scalars:scalars") not in rows
    assert ("/tip_error_mm/true", "Scalars:scalars") not in rows
    entities = {path for path, _ in rows}
    assert "/scene/tip" in entities
    assert entities.isdisjoint({"/scene/target", "/scene/target/frame"})
    for path in ("/scene/tip_true", "/scene/tip_measured"):
        assert (path, "Points3D:positions") not in rows


@pytest.mark.parametrize("lost", [12, 10], ids=["within a batch", "between two"])
def test_a_lost_target_is_cleared_and_its_series_end_once(lost: int, tmp_path: Path) -> None:
    arm = paper_arm()
    ticks = make_ticks(arm, 50)
    ticks["target_position_m"][:lost] = [0.03, 0.0, 0.2]
    ticks["target_orientation_xyzw"][:lost] = [0.0, 0.0, 0.0, 1.0]

    def show(view: View) -> None:
        for first in range(0, 50, 10):
            view.ticks(ticks[first : first + 10])

    rows = recorded(tmp_path / "a.rrd", arm, show)
    errors = scalars(rows, "/tip_error_mm/estimated")[:, 0]
    assert np.isnan(errors).tolist() == [False] * lost + [True] * (20 - lost)
    expected = np.linalg.norm(ticks["tip_estimated_position_m"][0] - [0.03, 0.0, 0.2])
    assert errors[0] == pytest.approx(1e3 * expected)
    for path in ("/scene/target", "/scene/target/frame"):
        assert rows[path, "Clear:is_recursive"] == [[False]]


def test_a_target_out_of_reach_looks_different(tmp_path: Path) -> None:
    arm = paper_arm()
    seen = []
    for reach in (pb.MOVING, pb.OUT_OF_REACH):
        ticks = make_ticks(arm, 1)
        ticks["target_position_m"], ticks["reach"] = [0.03, 0.0, 0.2], reach
        path = tmp_path / f"{reach}.rrd"
        rows = recorded(path, arm, lambda view, ticks=ticks: view.ticks(ticks))  # type: ignore[misc]
        assert ("/scene/target/frame", "Transform3D:translation") not in rows  # position only
        seen.append(rgb(rows, "/scene/target", "Points3D:colors"))
    assert seen[0] != seen[1]


def test_trail_is_bounded_in_time_and_memory() -> None:
    ticks = make_ticks(paper_arm(), 20_000)
    ticks["tip_true_position_m"] = np.linspace([0.0, 0.0, 0.0], [20.0, 0.0, 0.0], 20_000)
    trail = Trail()
    for first in range(0, 20_000, 33):
        trail.add(ticks[first : first + 33])
    x = trail.positions_m()[:, 0]
    assert 240 <= len(x) <= 251
    assert x[-1] > 19.9
    assert x[-1] - x[0] == pytest.approx(1e-9 * TRAIL_NS, abs=0.05)


def test_trail_starts_anew_when_a_replay_jumps_back() -> None:
    ticks = make_ticks(paper_arm(), 1000)
    trail = Trail()
    trail.add(ticks)
    assert len(trail.positions_m()) == 50
    trail.add(ticks[:100])
    assert len(trail.positions_m()) == 5


def test_trail_prefers_the_true_tip_then_the_measured_one() -> None:
    ticks = make_ticks(paper_arm(), 60)
    ticks["tip_measured_position_m"][20:] = [1.0, 0.0, 0.0]
    ticks["tip_true_position_m"][40:] = [2.0, 0.0, 0.0]
    trail = Trail()
    trail.add(ticks)
    assert trail.positions_m()[:, 0].tolist() == [0.0, 1.0, 2.0]


def test_modes_and_overruns_are_recorded_where_they_change(tmp_path: Path) -> None:
    arm = paper_arm()
    ticks = make_ticks(arm, 40)
    ticks["mode"][15:] = pb.HOLD
    ticks["overruns"] = 7  # of before this view was started
    ticks["overruns"][20:] = 8
    ticks["overruns"][25:] = 10
    ticks["compute_s"][[20, 25]] = 2e-3, 3e-3

    def show(view: View) -> None:
        for first in range(0, 40, 10):
            view.ticks(ticks[first : first + 10])

    rows = recorded(tmp_path / "a.rrd", arm, show)
    assert rows["/mode", "StateChange:state"] == [["ACTIVE"], ["HOLD"]]
    assert rows["/mode", "tick"] == [1, 16]
    assert scalars(rows, "/timing_us/overrun").tolist() == [[2000.0], [3000.0]]
    assert rows["/timing_us/overrun", "tick"] == [21, 26]


@pytest.mark.parametrize(
    ("level", "shown"),
    [(pb.INFO, "INFO"), (pb.WARNING, "WARN"), (pb.ERROR, "ERROR"), (0, "INFO")],
)
def test_events_keep_level_and_all_their_words(level: pb.Level, shown: str, tmp_path: Path) -> None:
    event = pb.Event(
        time_unix_ns=START_NS + 1_500_000_000,
        level=level,
        source="gateway",
        text="Target refused.",
        cause="Too far.",
        remedy="Use metres.",
    )
    rows = recorded(tmp_path / "a.rrd", paper_arm(), lambda view: view.event(event))
    assert rows["/events/gateway", "TextLog:level"] == [[shown]]
    ((text,),) = rows["/events/gateway", "TextLog:text"]
    assert text == "08:53:21.500 gateway: Target refused. Cause: Too far. Remedy: Use metres."


def test_status_names_mode_target_limits_and_error(tmp_path: Path) -> None:
    arm = paper_arm()
    ticks = make_ticks(arm, 1)
    ticks["target_kind"], ticks["reach"], ticks["law"] = pb.POSITION, pb.OUT_OF_REACH, pb.QP_IK
    ticks["target_position_m"] = ticks["tip_estimated_position_m"] + [0.0, 0.0, 0.0125]
    ticks["binding_limits"], ticks["overruns"] = 5, 3
    rows = recorded(tmp_path / "a.rrd", arm, lambda view: view.ticks(ticks))
    ((text,),) = rows["/status", "TextDocument:text"]
    for words in (
        "| Mode | ACTIVE |",
        "position (0.0, 0.0, 212.5) mm",
        "out of reach, by qp ik",
        "length, pressure",
        "estimated 12.5",
        "| Overruns | 3 so far |",
    ):
        assert words in text


@pytest.mark.parametrize(
    "gravity", [(0.0, 0.0, 9.81), (0.0, 0.0, -9.81), (9.81, 0.0, 0.0), (0.0, 0.0, 0.0)]
)
def test_the_eye_sees_the_whole_arm_with_gravity_down(
    gravity: tuple[float, float, float], tmp_path: Path
) -> None:
    arm = replace(paper_arm(), gravity_m_s2=gravity)
    rows = recorded(tmp_path / "a.rrd", arm, lambda view: None, blueprint=True)
    eye = {name: values[0][0] for (_, name), values in rows.items() if "EyeControls3D" in name}
    up = np.array(eye["EyeControls3D:eye_up"])
    fall = np.array(gravity) if any(gravity) else np.array([0.0, 0.0, 9.81])  # as it hangs
    np.testing.assert_allclose(up, -fall / np.linalg.norm(fall), atol=1e-6)
    position_m = np.array(eye["EyeControls3D:position"])
    ends = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, arm.max_length_m]]) - position_m
    ends /= np.linalg.norm(ends, axis=1, keepdims=True)
    apart_deg = np.degrees(np.arccos(ends[0] @ ends[1]))
    assert 20.0 < apart_deg < 50.0  # seen from the side, inside the field of view of 55 degrees


@both
def test_the_layout_shows_every_section(arm: Arm, tmp_path: Path) -> None:
    rows = recorded(tmp_path / "a.rrd", arm, lambda view: None, blueprint=True)
    shown = {
        values[0][0].strip("/")
        for (_, name), values in rows.items()
        if name == "ViewBlueprint:space_origin"
    }
    sections = range(1, arm.n_sections + 1)
    plots = {f"{plot}/section{n}" for plot in ("length_mm", "pressure_bar") for n in sections}
    others = {"scene", "status", "events", "mode", "tip_error_mm", "timing_us"}
    assert shown == plots | others
