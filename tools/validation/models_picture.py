"""The picture of the comparison: errors over the bend, and where gravity takes the tip."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.kinematics.constant_curvature import lengths_from_shapes
from pneuarm.controllers.kinematics.models.paper import SingularityFree
from pneuarm.service.pictures.pyplot import pyplot
from tools.validation.models import (
    MOUNTINGS,
    all_models,
    reference_rod,
    tip_errors_percent,
)

_MM_PER_M = 1e3
_BENDS = 61
#: Errors below this share (percent) are rounding and drawn at the bottom.
_FLOOR_PERCENT = 1e-13


def sweep(arm: Arm, low_rad: float, count: int = _BENDS) -> tuple[Array, Array]:
    """Bends (count,), rad, and lengths (count, 1, 3), m, at the rest length, toward +x."""
    bends = np.linspace(low_rad, arm.sections[0].bend_max_rad, count)
    rest = np.full(count, arm.sections[0].rest_length_m)
    shapes = np.stack([rest, bends, np.zeros(count)], axis=-1)
    return bends, lengths_from_shapes(shapes, arm.sections[0].chamber_offset_m)[:, None, :]


def draw(arm: Arm, weight_over_bending_per_m3: float, path: Path) -> None:
    """Write the picture as PNG."""
    figure, (left, right) = pyplot().subplots(1, 2, figsize=(11.0, 4.6), dpi=130)
    _draw_errors(left, arm, weight_over_bending_per_m3)
    _draw_tips(right, arm, weight_over_bending_per_m3)
    figure.tight_layout()
    figure.savefig(path)
    pyplot().close(figure)


def _draw_errors(axes: Any, arm: Arm, weight: float) -> None:
    bends, lengths = sweep(arm, 0.0)
    rod = reference_rod(arm, weight)
    reference = rod.tip_transform(replace(arm, gravity_m_s2=MOUNTINGS["no gravity"]), lengths)
    for model in all_models():
        errors = tip_errors_percent(model.tip_transform(arm, lengths), reference, lengths)
        axes.semilogy(np.degrees(bends), np.maximum(errors, _FLOOR_PERCENT), label=model.name)
    for name, line in (("hanging", "k--"), ("sideways", "k:")):
        there = rod.tip_transform(replace(arm, gravity_m_s2=MOUNTINGS[name]), lengths)
        errors = tip_errors_percent(reference, there, lengths)
        axes.semilogy(np.degrees(bends), errors, line, label=f"gravity left out, {name}")
    axes.set(xlabel="bend, degrees", ylabel="tip error, % of the length")
    axes.legend(fontsize=6, loc="lower right")
    axes.grid(alpha=0.3)


def _draw_tips(axes: Any, arm: Arm, weight: float) -> None:
    _, lengths = sweep(arm, -arm.sections[0].bend_max_rad, 13)
    rod = reference_rod(arm, weight)
    arc = SingularityFree().tip_transform(arm, lengths)[:, :3, 3] * _MM_PER_M
    axes.plot(arc[:, 0], arc[:, 2], "o-", lw=0.7, ms=4, label="constant curvature")
    for name in ("hanging", "sideways"):
        mounted = replace(arm, gravity_m_s2=MOUNTINGS[name])
        tips = rod.tip_transform(mounted, lengths)[:, :3, 3] * _MM_PER_M
        axes.plot(tips[:, 0], tips[:, 2], "o", ms=4, label=f"Cosserat rod, {name}")
        pairs = np.stack([arc, tips], axis=1)
        for pair in pairs:
            axes.plot(pair[:, 0], pair[:, 2], color="0.3", lw=1.5)
    axes.set(xlabel="x, mm", ylabel="z, mm (along the straight arm)", aspect="equal")
    axes.invert_yaxis()
    axes.legend(fontsize=6)
    axes.grid(alpha=0.3)
