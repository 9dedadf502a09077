"""Places where no part of the arm may be."""

from itertools import pairwise

import casadi as ca

from pneuarm.controllers.arm.arm import Arm, KeepOut, Sphere
from pneuarm.controllers.kinematics.compiled import symbolic_section, symbolic_shape
from pneuarm.controllers.limits.limit import Limit

#: Pieces of every section between two sampled stations of its backbone.
PIECES = 10

_TINY = 1e-24


class KeepOutLimit(Limit):
    """Keeps every point of the backbone ``body_radius_m`` away from every keep-out.

    Between two stations the backbone is taken as their chord, and what the arc stands off from it
    (at most ``L theta / (8 PIECES^2)``, below 2 mm) is taken away: never less than the truth.
    """

    name, bit = "keep-out", 8
    margin_m = 1e-4
    at_bound_m = 2.0 * margin_m

    @classmethod
    def applies_to(cls, arm: Arm) -> bool:
        """Whether there is a place to keep out of."""
        return bool(arm.keep_outs)

    def slack(self, lengths: ca.SX) -> ca.SX:
        """Clearance of every section from every keep-out: keep-outs in turn, base first."""
        sections = _stations(self._arm, lengths)
        clearances = [
            ca.mmin(ca.vertcat(*_clearances(place, points))) - standoff - self._arm.body_radius_m
            for place in self._arm.keep_outs
            for points, standoff in sections
        ]
        return ca.vertcat(*clearances) if clearances else ca.SX(0, 1)

    def contradiction(self) -> str:
        """Which keep-out contains a part of the arm at rest."""
        left_m = self.left_m(self._arm.rest_lengths_m)
        if (left_m >= 0.0).all():
            return ""
        place, section = divmod(int(left_m.argmin()), self._arm.n_sections)
        return (
            f"keep_outs[{place}] contains a part of section {section + 1} of the arm at rest, by "
            f"{-1e3 * left_m.min():.3g} mm (body_radius_mm counts); move it or make it smaller"
        )


def _stations(arm: Arm, lengths: ca.SX) -> list[tuple[list[ca.SX], ca.SX]]:
    """Of every section: PIECES + 1 points (3,) and how far the arc stands off from the chords."""
    origin, frame, sections = ca.SX(3, 1), ca.SX.eye(3), []
    for index, section in enumerate(arm.sections):
        shape = symbolic_shape(lengths[3 * index : 3 * index + 3], section)
        points = [origin]
        for piece in range(1, PIECES + 1):
            step, turn = symbolic_section(*(part * (piece / PIECES) for part in shape))
            points.append(origin + frame @ step)
        bend = ca.sqrt(shape[1] ** 2 + shape[2] ** 2 + _TINY)
        sections.append((points, shape[0] * bend / (8.0 * PIECES**2)))
        origin, frame = points[-1], frame @ turn
    return sections


def _clearances(place: KeepOut, points: list[ca.SX]) -> list[ca.SX]:
    """Distance of the chords between the points from a keep-out."""
    if not isinstance(place, Sphere):
        return [place.offset_m - ca.dot(ca.DM(place.normal), point) for point in points]
    center = ca.DM(place.center_m)
    return [_distance(center, first, second) - place.radius_m for first, second in pairwise(points)]


def _distance(center: ca.DM, first: ca.SX, second: ca.SX) -> ca.SX:
    """Distance of a point from the chord between two others."""
    chord = second - first
    share = ca.dot(center - first, chord) / (ca.sumsqr(chord) + _TINY)
    nearest = first + ca.fmin(ca.fmax(share, 0.0), 1.0) * chord
    return ca.sqrt(ca.sumsqr(center - nearest) + _TINY)
