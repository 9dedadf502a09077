"""What was fitted, for people: every parameter with its unit, before, after, its deviation."""

from dataclasses import dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.calibration.calibrate import Calibration
from pneuarm.controllers.calibration.fit import SEEN_SHARE
from pneuarm.controllers.calibration.parameters import COUPLINGS, NAMES, span_pa, values_of
from pneuarm.hardware.tables.table import BAR, DEG, MM

#: Key of the configuration, field of a Section, unit, one of it in SI.
_KEYS = (
    ("rest_length_mm", "rest_length_m", "mm", MM),
    ("chamber_offset_mm", "chamber_offset_m", "mm", MM),
    ("lengthening_mm_per_bar", "lengthening_m_per_pa", "mm/bar", MM / BAR),
    ("softening_mm_per_bar2", "softening_m_per_pa2", "mm/bar^2", MM / BAR**2),
    ("bending_compliance_deg_per_n_m", "bending_compliance_rad_per_n_m", "deg/(N m)", DEG),
    ("axial_compliance_mm_per_n", "axial_compliance_m_per_n", "mm/N", MM),
    ("hysteresis_bar", "hysteresis_pa", "bar", BAR),
)
#: Their places among the scaled parameters.
_PLACES = (0, 1, 2, 3, 4, 5, NAMES.index("hysteresis"))
_COUPLINGS = slice(6, 13)

_RESPONSE = (
    ("delay_ms", "delay_s", "ms", 1e-3),
    ("filling_lag_ms", "filling_lag_s", "ms", 1e-3),
    ("exhausting_lag_ms", "exhausting_lag_s", "ms", 1e-3),
    ("mode_hz", "mode_hz", "Hz", 1.0),
    ("damping_ratio", "damping_ratio", "", 1.0),
)


@dataclass(frozen=True)
class Value:
    """One parameter; ``section`` is its number from 1, or 0 for the whole arm.

    ``seen`` is False where the data said little: it is near what the configuration said.
    """

    section: int
    key: str
    unit: str
    before: float
    after: float
    deviation: float
    seen: bool = True


def values(calibration: Calibration) -> list[Value]:
    """All parameters of a calibration but the coupling, in the units of the configuration."""
    found = []
    for index in range(calibration.arm.n_sections):
        deviations = _deviations(calibration, index)
        for place, (key, field, unit, one) in zip(_PLACES, _KEYS, strict=True):
            before, after = (
                getattr(arm.sections[index], field) / one
                for arm in (calibration.before, calibration.arm)
            )
            seen = bool(calibration.fit.share[index, place] < SEEN_SHARE)
            deviation = deviations[field] / one
            found.append(Value(index + 1, key, unit, before, after, deviation, seen))
    for key, field, unit, one in _RESPONSE:
        before, after, deviation = (
            getattr(response, field) / one
            for response in (
                calibration.before.response,
                calibration.response.response,
                calibration.response.sd,
            )
        )
        found.append(Value(0, key, unit, before, after, deviation, seen=deviation > 0.0))
    return found


def _deviations(calibration: Calibration, index: int) -> dict[str, float]:
    """Standard deviation of every field of a section, SI."""
    before, sd = calibration.before, calibration.fit.sd[index]
    theta = calibration.fit.theta[index]
    here, there = values_of(before, index, theta), values_of(before, index, theta + sd)
    softer = values_of(before, index, theta + np.where(np.arange(len(sd)) == 3, sd, 0.0))
    there["softening_m_per_pa2"] = softer["softening_m_per_pa2"]
    found = {name: float(there[name] - here[name]) for name in here}
    found["hysteresis_pa"] = float(sd[NAMES.index("hysteresis")]) * span_pa(before.sections[index])
    return found


def coupling_deviations(calibration: Calibration, index: int) -> Array:
    """Standard deviations (3, 3) of a section's coupling, its elements taken as independent."""
    sd = calibration.fit.sd[index, _COUPLINGS]
    squares: Array = np.tensordot(sd**2, COUPLINGS**2, 1)
    return np.sqrt(squares)


def errors_mm(calibration: Calibration) -> tuple[Array, Array]:
    """Distances (rests,) from the modelled to the measured tips, before and after, mm."""
    fit = calibration.fit
    before, after = (
        np.linalg.norm(tips - fit.measured_m, axis=1) / MM for tips in (fit.before_m, fit.after_m)
    )
    return before, after


def held_out_mm(calibration: Calibration) -> Array:
    """Errors (rests,) of fits that did not see the rest they are judged at, mm."""
    return calibration.fit.held_out_m / MM


def direction_deg(angles_rad: Array) -> float | None:
    """Median (degrees) of angles between directions, None where no direction was measured."""
    seen = angles_rad[np.isfinite(angles_rad)]
    return float(np.rad2deg(np.median(seen))) if len(seen) else None


def worth_text(calibration: Calibration) -> str:
    """Say in one sentence what the fit is worth at places that it did not see."""
    held_out = held_out_mm(calibration)
    percent = 100.0 * np.nanmean(held_out) * MM / calibration.arm.total_rest_length_m
    sentence = (
        f"at rests that no fit had seen the tip is {np.nanmean(held_out):.2f} mm off on average "
        f"({percent:.2f} % of the arm's length), at most {np.nanmax(held_out):.1f} mm"
    )
    direction = direction_deg(calibration.fit.held_out_rad)
    if direction is None:
        return f"{sentence}; its direction was not measured"
    turned = float(np.rad2deg(np.arccos(np.clip(calibration.fit.frames.axis[2], -1.0, 1.0))))
    sentence += f", and points {direction:.1f} degrees elsewhere in the median"
    if turned > 1.0:
        sentence += (
            f" when the marker is taken to sit turned by {turned:.0f} degrees on the tip (see "
            "tip_in_marker_rotation_deg)"
        )
    return sentence


def residuals_text(calibration: Calibration) -> str:
    """Say in one sentence how far the modelled tip is from the measured one."""
    before, after = errors_mm(calibration)
    percent = 100.0 * after.mean() * MM / calibration.arm.total_rest_length_m
    return (
        f"over {len(after)} rests the modelled tip was {before.mean():.1f} mm off on average "
        f"before, is {after.mean():.2f} mm off now ({percent:.2f} % of the arm's length), at most "
        f"{after.max():.1f} mm"
    )


def value_text(value: Value) -> str:
    """One parameter in a line."""
    where = f"section {value.section}: " if value.section else ""
    unit = f" {value.unit}" if value.unit else ""
    if not (value.section or value.seen):
        return f"{value.key} = {value.after:.5g}{unit} as it was configured: not identified"
    unseen = "" if value.seen else " (hardly seen in this motion: near what was configured)"
    return (
        f"{where}{value.key} = {value.after:.5g} +- {value.deviation:.2g}{unit}, was "
        f"{value.before:.5g}{unseen}"
    )
