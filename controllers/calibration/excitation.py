"""Whether a recording shows enough: an error names the motion that is missing.

Two looks: at the pressures of the rests, before the fit, and at what the data left undetermined in
it, by the standard deviations that follow from the normalised Jacobian.
"""

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import CalibrationError
from pneuarm.controllers.calibration.fit import SEEN_SHARE, Fit
from pneuarm.controllers.calibration.parameters import NAMES
from pneuarm.controllers.calibration.recording import Recording, Rests

#: A chamber must have rested over this share of its pressure range.
_RANGE_SHARE = 0.25
#: The smallest spread of the pressures in any direction, as a share of that of a chamber.
_SPREAD_SHARE = 0.05
#: Fewer rests a section than this do not determine its fourteen parameters.
_RESTS_A_SECTION = 12

#: What must be moved to see a parameter; one that is not here may stay near its nominal value.
_MOTIONS = {
    "lengthening": "fill and, with vacuum, empty every chamber over most of its range",
    "bending_compliance": "bend the section far, by one chamber at a time, to several pressures",
    "hysteresis": "approach the same pressures from below and from above",
    "coupling": "move every chamber alone, and the chambers in pairs",
}


def place(arm: Arm, section: int, chamber: int) -> str:
    """Name a chamber for people, counted from 1."""
    if arm.n_sections == 1:
        return f"chamber {chamber + 1}"
    return f"chamber {chamber + 1} of section {section + 1}"


def require_motion(arm: Arm, recording: Recording, rests: Rests) -> None:
    """Raise CalibrationError where the rests cannot determine the map, whatever was measured."""
    pressures = recording.sent_pa[rests.last]
    _require_range(arm, pressures)
    needed = _RESTS_A_SECTION * arm.n_sections
    if len(pressures) < needed:
        raise CalibrationError(
            f"the arm rested at {len(pressures)} places with its tip measured; {needed} at least "
            "are needed to fit the map"
        )
    _require_independence(arm, pressures)


def _require_range(arm: Arm, pressures_pa: Array) -> None:
    low, high = pressures_pa.min(axis=0), pressures_pa.max(axis=0)
    allowed = arm.per_chamber("pressure_max_pa") - arm.per_chamber("pressure_min_pa")
    for section, chamber in np.argwhere(high - low < _RANGE_SHARE * allowed):
        at = (section, chamber)
        beyond = max(abs(low[at]), abs(high[at]))
        raise CalibrationError(
            f"{place(arm, *at)} was never moved beyond {1e-5 * beyond:.2f} bar: its lengthening "
            f"is not seen; let it rest at pressures over {1e-5 * _RANGE_SHARE * allowed[at]:.2f} "
            "bar or more"
        )


def _require_independence(arm: Arm, pressures_pa: Array) -> None:
    flat = pressures_pa.reshape(len(pressures_pa), -1)
    spread = flat / np.sqrt(np.mean(flat**2, axis=0))
    values, directions = np.linalg.svd(spread / np.sqrt(len(flat)), full_matrices=False)[1:]
    if values[-1] > _SPREAD_SHARE:
        return
    involved = np.argwhere(np.abs(directions[-1]) > 0.3)[:, 0]
    names = " and ".join(place(arm, *divmod(int(index), 3)) for index in involved)
    raise CalibrationError(
        f"{names} were always moved in the same proportion: which of them does what is not seen; "
        "move each of them alone"
    )


def require_determined(fit: Fit) -> None:
    """Raise CalibrationError for a fit in which the data left a needed parameter open."""
    open_ones = [
        (share, section, name)
        for section, shares in enumerate(fit.share)
        for name, share in zip(NAMES, shares, strict=True)
        if fit.sd[section, NAMES.index(name)] > 0.0 and _motion(name) and share > SEEN_SHARE
    ]
    if open_ones:
        _, section, name = max(open_ones)
        raise CalibrationError(
            f"the {name.split('_')[0]} of section {section + 1} is not determined by this motion: "
            f"{_motion(name)}"
        )


def _motion(name: str) -> str:
    return _MOTIONS.get("coupling" if name.startswith("coupling") else name, "")
