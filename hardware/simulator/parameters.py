"""What the simulated arm is made of: the nominal values, and those drawn for a seed."""

from dataclasses import MISSING, asdict, dataclass, field, fields, replace
from typing import Any, Literal

import numpy as np

#: Every parameter is multiplied by a factor drawn uniformly from 1 - VARIATION to 1 + VARIATION.
VARIATION = 0.2

#: Not multiplied: a number of pieces, and the mode from which the nominal stiffness is found. The
#: drawn arm has a mode of its own, which follows from its drawn masses and stiffnesses.
_NOT_VARIED = frozenset({"segments_per_section", "lowest_mode_hz"})


#: The valves that a simulated arm can have; NOMINAL says what each is made of.
Valves = Literal["servo", "itv", "onoff"]


def _parameter(nominal: Any, meaning: str) -> Any:
    """Return a field with its nominal value, MISSING where each kind has its own; and a meaning."""
    return field(default=nominal, metadata={"meaning": meaning})


@dataclass(frozen=True)
class SimulatorParameters:
    """The nominal arm. A hysteresis is the width of its loop as a fraction of the range.

    ``lowest_mode_hz`` and ``damping_ratio`` belong to the vented arm at rest under its gravity.
    With 2.2 Hz every drawn arm stays within 1.5 to 3 Hz: hanging, upside down or weightless.
    ``axial_stiffness_ratio`` is 1 where ``EI = EA d^2 / 2``, three tubes at the offset d.
    """

    segments_per_section: int = _parameter(5, "short arcs a section (not varied)")
    mass_per_length_kg_m: float = _parameter(1.5, "mass of the body along its length")
    plate_mass_kg: float = _parameter(0.05, "plate at the end of each section")
    gyration_radius_m: float = _parameter(0.025, "radius of gyration of every mass")
    axial_stiffness_ratio: float = _parameter(
        1.0, "1 where `EI = EA d^2 / 2`: three tubes at the offset d"
    )
    lowest_mode_hz: float = _parameter(
        2.2,
        "lowest mode of the nominal arm, vented, at rest under its gravity; the stiffness follows "
        "from it (not varied itself)",
    )
    damping_ratio: float = _parameter(0.15, "of the lowest mode")
    valve_time_constant_s: float = _parameter(
        0.06, "first-order lag; where the flow is limited, that of small errors"
    )
    valve_delay_s: float = _parameter(0.005, "dead time")
    valve_resolution_pa: float = _parameter(500.0, "step of the setpoint, 5 mbar")
    valve_hysteresis_fraction: float = _parameter(0.01, "width of the loop, a share of the range")
    chamber_hysteresis_fraction: float = _parameter(0.03, "width of the loop, a share of the range")
    creep_fraction: float = _parameter(
        0.03, "how much a chamber creeps, a share of the lengthening"
    )
    creep_time_constant_s: float = _parameter(10.0, "how slowly")
    sensor_noise_pa: float = _parameter(200.0, "standard deviation, 2 mbar")


@dataclass(frozen=True, kw_only=True)
class FlowParameters(SimulatorParameters):
    """An arm whose valves let no more air through than an orifice does.

    The conductances are sonic ones, as ISO 6358 has them. They act on the volume only by their
    ratio to it, so a log of pressures tells that ratio, and not the volume.
    """

    valve_supply_margin_pa: float = _parameter(
        MISSING, "how far the supply stands above the arm's largest pressure"
    )
    valve_volume_m3: float = _parameter(MISSING, "of a chamber with its tube")
    valve_filling_conductance_m3_s_pa: float = _parameter(
        MISSING, "sonic conductance from the supply into a chamber"
    )
    valve_exhausting_conductance_m3_s_pa: float = _parameter(
        MISSING, "sonic conductance out of a chamber"
    )
    valve_critical_pressure_ratio: float = _parameter(
        MISSING, "absolute pressure after over that before, below which the flow is choked"
    )


@dataclass(frozen=True, kw_only=True)
class RegulatorParameters(FlowParameters):
    """An arm behind regulators that open by degrees; opening takes time, closing none."""

    valve_filling_opening_s: float = _parameter(MISSING, "first-order lag of opening to fill")
    valve_exhausting_opening_s: float = _parameter(MISSING, "first-order lag of opening to exhaust")


@dataclass(frozen=True, kw_only=True)
class SwitchingParameters(FlowParameters):
    """An arm behind valves that are open or shut, a share of each period."""

    valve_pwm_hz: float = _parameter(MISSING, "periods a second")


#: The nominal arm with each kind of valves. docs/simulator.md says what is measured in it.
NOMINAL: dict[Valves, SimulatorParameters] = {
    "servo": SimulatorParameters(),
    "itv": RegulatorParameters(
        valve_time_constant_s=0.24,
        valve_delay_s=0.05,
        valve_supply_margin_pa=2e4,
        valve_volume_m3=7e-5,
        valve_filling_conductance_m3_s_pa=4.0e-10,
        valve_exhausting_conductance_m3_s_pa=6.2e-10,
        valve_critical_pressure_ratio=0.2,
        valve_filling_opening_s=0.12,
        valve_exhausting_opening_s=2.0,
    ),
    "onoff": SwitchingParameters(
        valve_time_constant_s=0.12,
        valve_delay_s=0.01,
        valve_supply_margin_pa=3e4,
        valve_volume_m3=7e-5,
        valve_filling_conductance_m3_s_pa=6.5e-10,
        valve_exhausting_conductance_m3_s_pa=6.5e-10,
        valve_critical_pressure_ratio=0.3,
        valve_pwm_hz=25.0,
    ),
}


@dataclass(frozen=True)
class DrawnParameters:
    """One arm of the family: ``values`` after variation, and what only a drawn arm has.

    ``stiffness_factors`` is one factor a section, true over nominal stiffness: the pressures act
    with the nominal one, so it is an error of the gain as well. ``values.lowest_mode_hz`` is the
    nominal mode until the rod has been built and the drawn arm's own one is known.
    """

    seed: int
    nominal: SimulatorParameters
    values: SimulatorParameters
    stiffness_factors: tuple[float, ...]

    def with_lowest_mode(self, lowest_mode_hz: float) -> "DrawnParameters":
        """Return a copy that also tells the drawn arm's own lowest mode."""
        return replace(self, values=replace(self.values, lowest_mode_hz=lowest_mode_hz))

    def as_dict(self) -> dict[str, float]:
        """Return the seed, every drawn value and every nominal one, for the session log."""
        record = {"seed": float(self.seed)}
        record |= {name: float(value) for name, value in asdict(self.values).items()}
        for index, factor in enumerate(self.stiffness_factors):
            record[f"stiffness_factor_section_{index}"] = factor
        for name, value in asdict(self.nominal).items():
            record[f"nominal_{name}"] = float(value)
        return record


def draw(nominal: SimulatorParameters, seed: int, n_sections: int) -> DrawnParameters:
    """Draw the arm of a seed: the same arguments give the same arm, on every machine.

    Whatever its valves are, the arm of a seed has the same body: what only some valves have is
    drawn last.
    """
    generator = np.random.Generator(np.random.PCG64(seed))
    names = [part.name for part in fields(nominal) if part.name not in _NOT_VARIED]
    n_common = len(fields(SimulatorParameters)) - len(_NOT_VARIED)
    factors = generator.uniform(1.0 - VARIATION, 1.0 + VARIATION, len(names) + n_sections).tolist()
    stiffness = factors[n_common : n_common + n_sections]
    del factors[n_common : n_common + n_sections]
    changes = {
        name: getattr(nominal, name) * factor for name, factor in zip(names, factors, strict=True)
    }
    return DrawnParameters(seed, nominal, replace(nominal, **changes), tuple(stiffness))
