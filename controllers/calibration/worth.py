"""What a fit is worth: whether it may be used, and if not, what was probably told wrongly.

A fit is judged at places that it did not see. One that is refused, or that could only do it with
values that no arm has, is compared with what would be so if the poses came from a frame that is
turned, if valves were exchanged, or if gravity acted in another direction: what explains the
motion far better is named.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import permutations

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import CalibrationError
from pneuarm.controllers.calibration.fit import Fit, nearest
from pneuarm.controllers.calibration.parameters import HIGHEST, NAMES
from pneuarm.controllers.calibration.recording import Recording, Rests
from pneuarm.controllers.geometry.rotations import rotation_vector

#: The mean error at places that were not seen may be this share of the arm's length, and this
#: share of how far the tip moved (the root of its mean square).
LARGEST_SHARE, LARGEST_OF_MOTION = 0.035, 0.2
#: Another explanation is one where it leaves less than this share of the error.
_BETTER = 0.6
#: A coupling this strong is more often a valve in another place.
_STRONG = 0.5
#: A fit this good (a share of the arm's length) is not doubted for its values.
_GOOD_SHARE = 0.005
#: A frame that is turned (rad) by less is none of its own; by more than the second it surely is.
_TURNED_RAD, _SURELY_TURNED_RAD = 0.05, 0.35
#: Explanations this near (m) to the best are told beside it.
_BESIDE_M = 5e-4


def require_worth(found: Fit, arm: Arm, recording: Recording, rests: Rests) -> None:
    """Raise CalibrationError for a fit that must not be used, with what was probably wrong."""
    why, mean_m = _why_not(found), float(found.errors_m.mean())
    if not why and not (_suspicious(found) and mean_m > _GOOD_SHARE * arm.total_rest_length_m):
        return
    # A body that is no arc is followed better from a base elsewhere: no reason to refuse it.
    turned_rad = _TURNED_RAD if why else _SURELY_TURNED_RAD
    others = _explanations(mean_m, arm, recording, rests, found.in_world, turned_rad)
    if why or others:
        worth = why or _worth_text(found, "and with values that hardly any arm has")
        raise CalibrationError(f"{worth}; {others or _NO_EXPLANATION}")


def explained(arm: Arm, recording: Recording, rests: Rests, in_world: bool) -> str:
    """What was probably told wrongly where no arm could be fitted at all."""
    mean_m = arm.total_rest_length_m
    others = _explanations(mean_m, arm, recording, rests, in_world, _TURNED_RAD)
    return others or _NO_EXPLANATION


_NO_EXPLANATION = (
    "look for what the configuration says wrongly of the arm (its sections, gravity, the order of "
    "the valves, the frame of the tip poses), and for a chamber that leaks or a marker that slips"
)


def motion_m(found: Fit) -> float:
    """How far the measured tip moved: the root of its mean square about its mean."""
    spread = found.measured_m - found.measured_m.mean(axis=0)
    return float(np.sqrt(np.mean(np.sum(spread**2, axis=1))))


def held_out_mean_m(found: Fit) -> float:
    """Mean error at rests that the fit did not see."""
    return float(np.nanmean(found.held_out_m))


def _why_not(found: Fit) -> str:
    """Say why a fit must not be used, or nothing."""
    for (section, place), value in np.ndenumerate(found.theta):
        if found.bound[section, place]:
            which = "upper" if value > 0.0 else "lower"
            return _worth_text(
                found,
                f"the {NAMES[place].replace('_', ' ')} of section {section + 1} ended on its "
                f"{which} bound, {np.exp(abs(value)):.0f} times what is configured"
                if place < 3
                else f"the {NAMES[place].replace('_', ' ')} of section {section + 1} ended on its "
                f"bound ({HIGHEST[place]:g} in its own scale)",
            )
    error, length = held_out_mean_m(found), found.arm.total_rest_length_m
    if error > LARGEST_SHARE * length:
        return _worth_text(found, f"at most {100.0 * LARGEST_SHARE:g} % are allowed")
    if error > LARGEST_OF_MOTION * motion_m(found):
        return _worth_text(
            found,
            f"that is {100.0 * error / motion_m(found):.0f} % of how far it moved "
            f"({1e3 * motion_m(found):.1f} mm), at most {100.0 * LARGEST_OF_MOTION:g} %",
        )
    return ""


def _worth_text(found: Fit, why: str) -> str:
    error, length = held_out_mean_m(found), found.arm.total_rest_length_m
    return (
        f"the fit leaves the tip {1e3 * error:.1f} mm off in the mean at places that it did not "
        f"see, {100.0 * error / length:.1f} % of the arm's length; {why}"
    )


def _suspicious(found: Fit) -> bool:
    """Whether the fit needed values that are more often a mistake elsewhere."""
    theta = found.theta
    weightless = bool(np.all(theta[:, 4] < 1e-3)) and float(found.share[:, 4].min()) < 1.0
    return weightless or bool(np.any(np.abs(theta[:, 6:13]) > _STRONG))


def _explanations(
    mean_m: float,
    arm: Arm,
    recording: Recording,
    rests: Rests,
    in_world: bool,
    turned_rad: float,
) -> str:
    """What would explain the motion far better than ``mean_m``, in words, joined by "or"."""
    others = _alternatives(arm, recording, rests, in_world, turned_rad)
    most = min(_BETTER * mean_m, LARGEST_SHARE * arm.total_rest_length_m)
    told = [(error, text) for error, text in others if error < most]
    least = min((error for error, _ in told), default=0.0)
    return ", or ".join(
        f"it would be {1e3 * error:.1f} mm {text}"
        for error, text in told
        if error <= least + _BESIDE_M
    )


def _alternatives(
    arm: Arm, recording: Recording, rests: Rests, in_world: bool, turned_rad: float
) -> Iterator[tuple[float, str]]:
    """Mean error (m) if something else were so, and what."""
    for order in list(permutations(range(3)))[1:]:
        moved = replace(recording, sent_pa=recording.sent_pa[..., order])
        yield nearest(arm, moved, rests, in_world)[0], _order_text(order)
    for gravity in _other_gravities(arm):
        other = replace(arm, gravity_m_s2=gravity)
        yield (
            nearest(other, recording, rests, in_world)[0],
            f"with arm.gravity_m_s2 = {[round(each, 2) for each in gravity]}: look which way the "
            "arm is mounted",
        )
    if not in_world:
        error, frames = nearest(arm, recording, rests, True)
        turn = rotation_vector(frames.rotation)
        angle, away = float(np.linalg.norm(turn)), float(np.linalg.norm(frames.translation_m))
        if angle > turned_rad:
            yield (
                error,
                f"if the frame of the tip poses were turned by {np.rad2deg(angle):.0f} degrees "
                f"about {_triple(turn / max(angle, 1e-9))} and {1e3 * away:.0f} mm away from the "
                "base: set [frames], or calibrate with --world",
            )


def _order_text(order: tuple[int, ...]) -> str:
    moved = [
        f"chamber {chamber + 1} by valve {valve + 1}"
        for chamber, valve in enumerate(order)
        if chamber != valve
    ]
    return (
        f"with {' and '.join(moved)} in every section: exchange their tubes, or their valves in "
        "the device's configuration"
    )


def _triple(vector: Array) -> str:
    return "(" + ", ".join(f"{value:.2f}" for value in vector.tolist()) + ")"


def _other_gravities(arm: Arm) -> list[tuple[float, float, float]]:
    """The same gravity along the other axes of the base."""
    own = np.array(arm.gravity_m_s2)
    size = float(np.linalg.norm(own)) or 9.81
    axes = np.concatenate([-np.eye(3), np.eye(3)])
    others = [size * axis for axis in axes if axis @ own < 0.9 * size]
    return [(float(x), float(y), float(z)) for x, y, z in others]
