"""Arm and Section: the frozen geometry and limits that everything else is sized by.

Arrays of chamber quantities have the shape ``(n_sections, 3)``; SI units throughout.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pneuarm.controllers.arm.errors import InvalidInput

Array = NDArray[np.float64]

#: Base angles of the three chambers around the backbone, rad.
CHAMBER_ANGLES_RAD = np.deg2rad([0.0, 120.0, 240.0])
CHAMBER_ANGLES_RAD.setflags(write=False)

#: Eq. (4) is an open interval: a command stays this far (m) inside its ends.
LENGTH_MARGIN_M = 1e-6


#: Which chamber lengthens under which pressure, and how strongly.
Row = tuple[float, float, float]
Coupling = tuple[Row, Row, Row]

#: Each chamber lengthens under its own pressure alone.
UNCOUPLED: Coupling = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

#: A coupling whose smallest singular value is below this share of the largest has no safe inverse.
_COUPLING_SINGULAR = 0.02


@dataclass(frozen=True)
class Section:
    """One section: three chambers parallel to the backbone between two rigid plates.

    The fields from ``lengthening_m_per_pa`` on are the calibrated map between pressure and length,
    see :mod:`pneuarm.controllers.actuation.pressure_map`; their defaults are those of a section
    without load, coupling and hysteresis. ``hysteresis_pa`` is half the width of the loop,
    ``coupling`` (3, 3) has one row a chamber that lengthens and one column a chamber under
    pressure.
    """

    rest_length_m: float
    chamber_offset_m: float
    length_min_m: float
    length_max_m: float
    bend_max_rad: float
    length_rate_max_m_s: float
    length_acceleration_max_m_s2: float
    pressure_min_pa: float
    pressure_max_pa: float
    pressure_slew_max_pa_s: float
    lengthening_m_per_pa: float
    softening_m_per_pa2: float = 0.0
    coupling: Coupling = UNCOUPLED
    hysteresis_pa: float = 0.0
    bending_compliance_rad_per_n_m: float = 0.0
    axial_compliance_m_per_n: float = 0.0

    def __post_init__(self) -> None:
        """Raise InvalidInput where two bounds contradict each other, or no inverse map exists."""
        _invertible(self.coupling)
        _ordered("length_min_m", self.length_min_m, "rest_length_m", self.rest_length_m)
        _ordered("rest_length_m", self.rest_length_m, "length_max_m", self.length_max_m)
        _ordered("pressure_min_pa", self.pressure_min_pa, "pressure_max_pa", self.pressure_max_pa)
        if self.pressure_min_pa > 0.0 or self.pressure_max_pa < 0.0:
            raise InvalidInput(
                f"pressure_min_pa = {self.pressure_min_pa:g}, pressure_max_pa = "
                f"{self.pressure_max_pa:g}: zero (ambient, the vented arm) must lie between them"
            )


def uncalibrated(section: Section) -> Section:
    """Return the section with each chamber on its own: no coupling, load or hysteresis."""
    return replace(
        section,
        coupling=UNCOUPLED,
        hysteresis_pa=0.0,
        bending_compliance_rad_per_n_m=0.0,
        axial_compliance_m_per_n=0.0,
    )


def _ordered(low_name: str, low: float, high_name: str, high: float) -> None:
    if not low < high:
        raise InvalidInput(f"{low_name} = {low:g} must be less than {high_name} = {high:g}")


def _invertible(coupling: Coupling) -> None:
    matrix = np.asarray(coupling, dtype=np.float64)
    if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
        raise InvalidInput(f"coupling = {coupling}: three rows of three finite numbers are needed")
    values = np.linalg.svd(matrix, compute_uv=False)
    if values[-1] < _COUPLING_SINGULAR * values[0]:
        raise InvalidInput(
            f"coupling = {matrix.tolist()}: its rows must be independent, so that every length "
            "has its pressures"
        )


def _frozen(values: object) -> Array:
    array = np.asarray(values, dtype=np.float64)
    array.setflags(write=False)
    return array


@dataclass(frozen=True, kw_only=True)
class Response:
    """How the arm answers to a step of the pressures: dead time, lags of the valves, lowest mode.

    Between the pressure u that is sent and the pressure p in a chamber lie a dead time and a lag of
    first order, which is another one where air goes in than where it goes out:

        dp/dt = (u(t - delay) - p) / lag,    filling where u(t - delay) > p, else exhausting

    ``mode_hz`` and ``damping_ratio`` (of the lowest bending mode) lie between that pressure and the
    shape of the arm. ``lead_max_pa`` is how far a setpoint may run ahead of slow valves.
    """

    delay_s: float = 0.005
    filling_lag_s: float = 0.06
    exhausting_lag_s: float = 0.06
    mode_hz: float = 2.2
    damping_ratio: float = 0.15
    lead_max_pa: float = 4e3

    @property
    def slower_lag_s(self) -> float:
        """The larger one of the two lags."""
        return max(self.filling_lag_s, self.exhausting_lag_s)

    def left(self, passed_s: float) -> tuple[float, float]:
        """Shares of what a pressure lacks that it still lacks after a time: filling, exhausting."""
        filling_s, exhausting_s = self.filling_lag_s, self.exhausting_lag_s
        return (
            math.exp(-passed_s / filling_s) if filling_s else 0.0,
            math.exp(-passed_s / exhausting_s) if exhausting_s else 0.0,
        )


@dataclass(frozen=True)
class Sphere:
    """A place where no part of the arm may be: a ball around ``center_m`` (3,), base frame."""

    center_m: tuple[float, float, float]
    radius_m: float


@dataclass(frozen=True)
class HalfSpace:
    """A place where no part of the arm may be: all points with ``normal . p > offset_m``.

    ``normal`` (3,) is a unit vector in the base frame and points into the forbidden side.
    """

    normal: tuple[float, float, float]
    offset_m: float


KeepOut = Sphere | HalfSpace


@dataclass(frozen=True)
class Arm:
    """A named list of sections, base first, how gravity acts on it and how it answers.

    ``gravity_m_s2`` is the acceleration of gravity in the base frame (z from base to tip of the
    straight arm): ``(0, 0, 9.81)`` is an arm that hangs. ``mass_kg`` is the mass of all sections,
    spread evenly over their rest lengths; it acts only where a section has a compliance.
    ``tool_m`` is the point in the tip frame that counts as the tip everywhere. The backbone stays
    ``body_radius_m`` away from every one of the ``keep_outs``.
    """

    name: str
    sections: tuple[Section, ...]
    gravity_m_s2: tuple[float, float, float] = (0.0, 0.0, 9.81)
    mass_kg: float = 1.0
    response: Response = Response()
    tool_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    keep_outs: tuple[KeepOut, ...] = ()
    body_radius_m: float = 0.0

    def __post_init__(self) -> None:
        """Raise InvalidInput for an arm without sections."""
        if not self.sections:
            raise InvalidInput(f"arm {self.name!r} has no sections; at least one is needed")

    @property
    def n_sections(self) -> int:
        """Number of sections."""
        return len(self.sections)

    @property
    def n_chambers(self) -> int:
        """Number of chambers, three a section."""
        return 3 * len(self.sections)

    def per_section(self, field: str) -> Array:
        """Return a Section field as a read-only array of shape ``(n_sections, 1)``."""
        return _frozen([[getattr(section, field)] for section in self.sections])

    def per_chamber(self, field: str) -> Array:
        """Return a Section field as a read-only array of shape ``(n_sections, 3)``."""
        return _frozen(np.repeat(self.per_section(field), 3, axis=1))

    @cached_property
    def length_interval_m(self) -> tuple[Array, Array]:
        """Shortest and longest lengths ``(n_sections, 3)`` that a chamber may be told to take.

        Eq. (4) is ``l0/2 < l < 3 l0/2``; the arm says its own ends, and LENGTH_MARGIN_M keeps off.
        """
        low = self.per_chamber("length_min_m") + LENGTH_MARGIN_M
        high = self.per_chamber("length_max_m") - LENGTH_MARGIN_M
        return _frozen(low), _frozen(high)

    @cached_property
    def rest_lengths_m(self) -> Array:
        """Chamber lengths of the vented arm without load, ``(n_sections, 3)``."""
        return self.per_chamber("rest_length_m")

    @cached_property
    def total_rest_length_m(self) -> float:
        """Backbone length of the vented arm without load."""
        return float(sum(section.rest_length_m for section in self.sections))

    @cached_property
    def max_length_m(self) -> float:
        """Backbone length with every chamber at its upper bound."""
        return float(sum(section.length_max_m for section in self.sections))
