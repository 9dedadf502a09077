"""Whether the limits of an arm leave it a place to be: its shape at rest, vented."""

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.limits.keep_out import KeepOutLimit


def refuse_contradictions(arm: Arm) -> None:
    """Raise InvalidInput, in one sentence, where the limits exclude each other or the arm at rest.

    The vented arm is straight and at its rest lengths: it must be inside every limit, since it is
    there that every session begins and ends.
    """
    low, high = length_bounds_m(arm)
    if not (low < high).all():
        section = int((low >= high).any(axis=1).argmax())
        raise InvalidInput(
            f"section {section + 1}: the pressure range and the interval of lengths leave no "
            f"length; it would lie between {1e3 * low[section, 0]:.4g} and "
            f"{1e3 * high[section, 0]:.4g} mm"
        )
    if not arm.keep_outs:
        return
    left_m = KeepOutLimit(arm).left_m(arm.rest_lengths_m).reshape(-1, arm.n_sections)
    if (left_m < 0.0).any():
        place, section = divmod(int(left_m.argmin()), arm.n_sections)
        raise InvalidInput(
            f"keep_outs[{place}] contains a part of section {section + 1} of the arm at rest, by "
            f"{-1e3 * left_m.min():.3g} mm (body_radius_mm counts); move it or make it smaller"
        )
