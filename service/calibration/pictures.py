"""The pictures of a calibration, as PNG."""

from collections.abc import Callable
from io import BytesIO
from typing import Any

import numpy as np

from pneuarm.controllers.calibration.calibrate import Calibration
from pneuarm.controllers.calibration.excitation import place
from pneuarm.hardware.tables.table import BAR, MM
from pneuarm.service.calibration.values import errors_mm
from pneuarm.service.pictures.pyplot import pyplot

_BEFORE, _AFTER, _MEASURED = "#d08a3c", "#1f6fb2", "#222222"
#: Of the pressure range: a chamber below this counts as not moved.
_ALONE_SHARE = 0.02


def pictures(calibration: Calibration) -> dict[str, bytes]:
    """Return PNG by caption, in the order of the page."""
    drawn = {
        "Where the tip was measured, and where the model puts it, before and after. Lines join "
        "what belongs together: the shorter, the better.": _picture(_tips, calibration, (11, 4.8)),
        "Distance of the modelled tip from the measured one at every rest, in the order of the "
        "motion.": _picture(_errors, calibration, (11, 3.4)),
        "What is left, by coordinate: noise without a trend is what a good fit leaves.": _picture(
            _residuals, calibration, (11, 3.0)
        ),
    }
    if _loops(calibration):
        drawn[
            "Hysteresis: one chamber moved alone, up and down. The tip's way in the direction of "
            "the chamber; the width of the loop is what the fitted play gives back."
        ] = _picture(_hysteresis, calibration, (11, 3.6 * -(-len(_loops(calibration)) // 3)))
    if calibration.response.steps:
        rows = -(-min(6, len(calibration.response.steps)) // 3)
        drawn[
            "Steps of the pressure: the tip along its way, measured and as the fitted mode swings. "
            "The modelled curve is shifted and scaled onto the measured one."
        ] = _picture(_steps, calibration, (11, 3.2 * rows))
    return drawn


def _picture(
    draw: Callable[[Any, Calibration], None], calibration: Calibration, size: tuple[float, float]
) -> bytes:
    figure = pyplot().figure(figsize=size, dpi=110, layout="constrained")
    draw(figure, calibration)
    png = BytesIO()
    figure.savefig(png, format="png")
    pyplot().close(figure)
    return png.getvalue()


def _tips(figure: Any, calibration: Calibration) -> None:
    fit = calibration.fit
    views = (("x", "y", 0, 1), ("x", "z", 0, 2), ("y", "z", 1, 2))
    for axes, (across, up, i, j) in zip(figure.subplots(1, 3), views, strict=True):
        for tips, color, label in (
            (fit.before_m, _BEFORE, "before"),
            (fit.after_m, _AFTER, "after"),
        ):
            pairs = np.stack([fit.measured_m, tips], axis=1) / MM
            axes.plot(pairs[:, :, i].T, pairs[:, :, j].T, color=color, lw=0.8)
            axes.plot(pairs[:, 1, i], pairs[:, 1, j], ".", color=color, ms=5, label=label)
        measured = fit.measured_m / MM
        axes.plot(measured[:, i], measured[:, j], "o", color=_MEASURED, ms=3.5, label="measured")
        axes.set(xlabel=f"{across}, mm", ylabel=f"{up}, mm")
        axes.set_aspect("equal", adjustable="datalim")
        if up == "z":
            axes.invert_yaxis()
        axes.grid(alpha=0.3)
    figure.axes[0].legend(fontsize=8)


def _errors(figure: Any, calibration: Calibration) -> None:
    axes = figure.subplots()
    numbers = np.arange(len(calibration.fit.measured_m)) + 1
    for errors, color, label in zip(
        errors_mm(calibration), (_BEFORE, _AFTER), ("before", "after"), strict=True
    ):
        told = f"{label}, mean {errors.mean():.1f} mm"
        axes.bar(numbers, errors, color=color, width=0.8, label=told)
    axes.set(xlabel="rest", ylabel="tip error, mm", xlim=(0.0, len(numbers) + 1.0))
    axes.legend(fontsize=8, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    axes.grid(axis="y", alpha=0.3)


def _residuals(figure: Any, calibration: Calibration) -> None:
    fit = calibration.fit
    axes = figure.subplots()
    numbers = np.arange(len(fit.measured_m)) + 1
    left = (fit.after_m - fit.measured_m) / MM
    for index, (name, marker) in enumerate(zip("xyz", "o^s", strict=True)):
        axes.plot(numbers, left[:, index], marker, ms=4, label=name)
    axes.axhline(0.0, color="0.4", lw=0.8)
    axes.set(xlabel="rest", ylabel="model - measured, mm", xlim=(0.0, len(numbers) + 1.0))
    axes.legend(fontsize=8, ncols=3)
    axes.grid(alpha=0.3)


def _loops(calibration: Calibration) -> list[tuple[int, int, Any]]:
    """Section, chamber and rests (indices in order) at which it alone was moved, up and down."""
    fit, arm = calibration.fit, calibration.before
    span = arm.per_chamber("pressure_max_pa") - arm.per_chamber("pressure_min_pa")
    moved = np.abs(fit.pressures_pa) > _ALONE_SHARE * span
    found = []
    for section, chamber in np.ndindex(*span.shape):
        others = moved.copy()
        others[:, section, chamber] = False
        alone = np.flatnonzero(~others.any(axis=(1, 2)) & moved[:, section, chamber])
        if len(alone) >= 4:
            found.append((section, chamber, _stretch(alone)))
    return found


def _stretch(alone: Any) -> Any:
    """Keep the first stretch of rests, with the vented ones between: what follows is later."""
    gaps = np.flatnonzero(np.diff(alone) > 3)
    last = alone[gaps[0]] if len(gaps) else alone[-1]
    return np.arange(alone[0], last + 1)


def _hysteresis(figure: Any, calibration: Calibration) -> None:
    fit, loops = calibration.fit, _loops(calibration)
    columns = min(3, len(loops))
    every = figure.subplots(-(-len(loops) // columns), columns, squeeze=False).reshape(-1)
    for axes in every[len(loops) :]:
        axes.set_axis_off()
    for axes, (section, chamber, rests) in zip(every, loops, strict=False):
        tips = fit.measured_m[rests]
        direction = np.linalg.svd(tips - tips.mean(axis=0))[2][0]
        bar = fit.pressures_pa[rests, section, chamber] / BAR
        for way, style, color, label in (
            (fit.measured_m, "o-", _MEASURED, "measured"),
            (fit.after_m, "x--", _AFTER, "model"),
        ):
            along = (way[rests] - tips.mean(axis=0)) @ direction / MM
            sign = np.sign(np.polyfit(bar, along, 1)[0]) or 1.0
            axes.plot(bar, sign * along, style, color=color, ms=4, lw=1.0, label=label)
        axes.set(
            title=place(calibration.arm, section, chamber),
            xlabel="pressure sent, bar",
            ylabel="tip along its way, mm",
        )
        axes.grid(alpha=0.3)
    every[0].legend(fontsize=8)


def _steps(figure: Any, calibration: Calibration) -> None:
    steps = sorted(calibration.response.steps, key=lambda step: -float(np.ptp(step.measured_m)))[:6]
    columns = min(3, len(steps))
    every = figure.subplots(-(-len(steps) // columns), columns, squeeze=False).reshape(-1)
    for axes in every[len(steps) :]:
        axes.set_axis_off()
    for axes, step in zip(every, steps, strict=False):
        axes.plot(step.time_s, step.measured_m / MM, color=_MEASURED, lw=1.6, label="measured")
        axes.plot(step.time_s, step.modelled_m / MM, "--", color=_AFTER, lw=1.4, label="model")
        axes.set(xlabel="time, s", ylabel="tip, mm")
        axes.grid(alpha=0.3)
    every[0].legend(fontsize=8)
