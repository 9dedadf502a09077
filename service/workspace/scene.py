"""A workspace in Rerun: the boundary, the samples by manipulability, and the arm inside."""

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from pneuarm.controllers.workspace.mesh import Mesh
from pneuarm.controllers.workspace.sampling import Samples
from pneuarm.controllers.workspace.summary import Summary
from pneuarm.logs.view import colors as colors
from pneuarm.logs.view.geometry import ArmShape
from pneuarm.service.workspace.poses import typical_lengths

_BOUNDARY = (90, 150, 200, 30)
_LOW, _HIGH = np.array([40.0, 70.0, 200.0]), np.array([255.0, 210.0, 60.0])
_MOST_POINTS = 20_000
_BACKGROUND = (22, 24, 28)


def write_rrd(path: Path, summary: Summary) -> None:
    """Write the recording, with the layout in which it opens."""
    recording = rr.RecordingStream(f"pneuarm_workspace_{summary.arm.name}")
    recording.save(path, default_blueprint=_blueprint(summary))
    _boundary(recording, summary.mesh)
    _samples(recording, summary.samples)
    _arms(recording, summary)
    recording.flush()
    recording.disconnect()


def _blueprint(summary: Summary) -> rrb.Blueprint:
    """From the side like the picture: x to the right, and the arm hangs where gravity says so."""
    up = np.array([0.0, 0.0, -1.0 if summary.arm.gravity_m_s2[2] > 0.0 else 1.0])
    ends = np.concatenate([summary.extents_m, np.zeros((1, 3))])  # the base too
    middle = 0.5 * (ends.min(axis=0) + ends.max(axis=0))
    from_side = -1.3 * float(np.ptp(ends, axis=0).max()) * np.cross(up, [1.0, 0.0, 0.0])
    kind = "outer hull" if summary.mesh.outer_hull else "boundary"
    view = rrb.Spatial3DView(
        origin="workspace",
        name=f"Workspace of {summary.arm.name}: {kind}; samples blue (stiff) to yellow (mobile)",
        background=_BACKGROUND,
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=middle + from_side,
            look_target=middle,
            eye_up=up,
        ),
    )
    return rrb.Blueprint(view, collapse_panels=True)


def _boundary(recording: rr.RecordingStream, mesh: Mesh) -> None:
    surface = rr.Mesh3D(
        vertex_positions=mesh.vertices_m.astype(np.float32),
        triangle_indices=mesh.triangles.astype(np.uint32),
        albedo_factor=_BOUNDARY,
    )
    recording.log("workspace/boundary", surface, static=True)


def _samples(recording: rr.RecordingStream, samples: Samples) -> None:
    every = max(1, len(samples.positions_m) // _MOST_POINTS)
    values = samples.manipulability[::every]
    low, high = np.percentile(values, [2.0, 98.0])
    share = np.clip((values - low) / max(high - low, 1e-12), 0.0, 1.0)[:, None]
    points = rr.Points3D(
        samples.positions_m[::every],
        colors=(_LOW + share * (_HIGH - _LOW)).astype(np.uint8),
        radii=rr.Radius.ui_points(1.0),
    )
    recording.log("workspace/samples", points, static=True)


def _arms(recording: rr.RecordingStream, summary: Summary) -> None:
    shape, by_length = ArmShape(summary.arm), colors.LengthColors(summary.arm)
    thin_m = 0.05 * summary.arm.sections[0].chamber_offset_m
    for index, lengths_m in enumerate(typical_lengths(summary.arm)):
        lines = shape.lines(lengths_m)
        chambers = rr.LineStrips3D(lines.chambers_m, colors=by_length.of(lengths_m), radii=thin_m)
        plates = rr.LineStrips3D(
            [lines.backbone_m, *lines.plates_m], colors=colors.PLATE, radii=thin_m
        )
        recording.log(f"workspace/arm/{index}/chambers", chambers, static=True)
        recording.log(f"workspace/arm/{index}/plates", plates, static=True)
