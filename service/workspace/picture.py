"""A workspace as a picture, after the paper's Fig. 3: from the side, with the arm drawn inside."""

from pathlib import Path
from typing import Any

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.workspace.region import SectionRegion
from pneuarm.controllers.workspace.sampling import Samples, samples_of
from pneuarm.controllers.workspace.summary import Summary
from pneuarm.logs.view import colors as colors
from pneuarm.logs.view.geometry import ArmShape
from pneuarm.service.pictures.pyplot import pyplot
from pneuarm.service.workspace.poses import typical_lengths

_MM = 1e3
_FILL, _EDGE = "#d4e4f1", "#4a7ba6"
_GRID = 220


def write_png(path: Path, summary: Summary) -> None:
    """Draw the arms inside the workspace, and beside it the manipulability; both from the side."""
    figure, (left, right) = pyplot().subplots(
        1, 2, figsize=(15, 7.5), layout="constrained", sharex=True, sharey=True
    )
    for axes in (left, right):
        _outline(axes, summary)
    _arms(left, summary)
    _manipulability(figure, right, summary)
    for axes in (left, right):
        _frame(axes, summary)
    figure.suptitle(_title(summary))
    figure.savefig(path, dpi=110)
    pyplot().close(figure)


def _title(summary: Summary) -> str:
    kind = "outer hull (convex)" if summary.mesh.outer_hull else "boundary"
    litres, error = 1e3 * summary.volume.value, 1e3 * summary.volume.error
    return f"Workspace of the arm {summary.arm.name}: {kind}, volume {litres:.4g} litres " + (
        f"(error {error:.1g})"
    )


def _outline(axes: Any, summary: Summary) -> None:
    """Fill what the surface covers seen along y; its section with the plane y = 0 as a line."""
    from matplotlib import collections

    side = _MM * summary.mesh.corners_m[:, :, [0, 2]]
    axes.add_collection(
        collections.PolyCollection(list(side), facecolor=_FILL, edgecolor=_FILL, lw=0.3)
    )
    cut = _MM * plane_section(summary.mesh.corners_m)[:, :, [0, 2]]
    axes.add_collection(collections.LineCollection(list(cut), colors=_EDGE, linewidths=1.4))


def plane_section(corners_m: Array) -> Array:
    """Lines ``(n, 2, 3)`` in which triangles ``(m, 3, 3)`` meet the plane y = 0."""
    y = corners_m[:, :, 1]
    # A vertex in the plane counts as in front of it, so every triangle has two cut edges or none.
    front = y >= -1e-12
    cut = corners_m[front.any(axis=1) & ~front.all(axis=1)]
    ends = []
    for corners in cut:
        crossing = []
        for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            if (start[1] >= -1e-12) != (end[1] >= -1e-12):
                share = start[1] / (start[1] - end[1])
                crossing.append(start + share * (end - start))
        ends.append(crossing)
    return np.array(ends).reshape(-1, 2, 3)


def _arms(axes: Any, summary: Summary) -> None:
    shape, by_length = ArmShape(summary.arm), colors.LengthColors(summary.arm)
    for lengths_m in typical_lengths(summary.arm):
        lines = shape.lines(lengths_m)
        for chamber, color in zip(lines.chambers_m, by_length.of(lengths_m), strict=True):
            shade = tuple(0.8 * color / 255.0)
            axes.plot(*(_MM * chamber[:, [0, 2]]).T, color=shade, lw=2.2, alpha=0.8)
        for plate in lines.plates_m:
            axes.plot(*(_MM * plate[:, [0, 2]]).T, color="#555555", lw=1.5)
        axes.plot(*(_MM * lines.backbone_m[:, [0, 2]]).T, color="black", lw=0.8, ls="--")
        axes.plot(*(_MM * lines.backbone_m[-1, [0, 2]]), "o", color="black", ms=5)
    words = "Seen along y; line: cut by y = 0; chambers from blue (shortest) to red (longest)"
    axes.set_title(words)


def _manipulability(figure: Any, axes: Any, summary: Summary) -> None:
    """Colour the plane y = 0: every place in it for one section, samples next to it for several."""
    samples, what = _in_plane(summary), "in the plane y = 0"
    if samples is None:
        samples, what = _next_to_plane(summary.samples), "of random lengths, next to y = 0"
    dots = axes.scatter(
        *(_MM * samples.positions_m[:, [0, 2]]).T,
        c=samples.manipulability,
        s=4,
        marker="s",
        linewidths=0,
        cmap="viridis",
    )
    label = "manipulability sqrt(det(J J^T)), J = dp/dl [m/m]"
    figure.colorbar(dots, ax=axes, label=label, shrink=0.8)
    axes.set_title(f"Manipulability {what}")


def _in_plane(summary: Summary) -> Samples | None:
    """Samples on a grid in the plane y = 0, or None for an arm of several sections."""
    if not summary.exact:
        return None
    low, high = summary.extents_m
    x, z = np.meshgrid(*(np.linspace(low[axis], high[axis], _GRID) for axis in (0, 2)))
    points = np.stack([x, np.zeros_like(x), z], axis=-1).reshape(-1, 3)
    return samples_of(SectionRegion(summary.arm), points)


def _next_to_plane(samples: Samples) -> Samples:
    order = np.argsort(np.abs(samples.positions_m[:, 1]))
    return samples.chosen(order[: len(order) // 4])


def _frame(axes: Any, summary: Summary) -> None:
    """Millimetres at one scale, the base at the origin, gravity downward."""
    radius = 1.8 * _MM * summary.arm.sections[0].chamber_offset_m
    axes.plot([-radius, radius], [0.0, 0.0], color="#333333", lw=6, solid_capstyle="butt")
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("z [mm], along the straight arm from its base")
    axes.grid(alpha=0.3)
    if summary.arm.gravity_m_s2[2] > 0.0:
        axes.yaxis.set_inverted(True)
