"""An emulated valve terminal's arm: the simulated arm behind it, driven by real time passed in.

Emulators of devices share it: the protocol is theirs, the air, the body and the sensors are here.
Nothing here reads a clock. The same calls with the same seed give the same bits.
"""

import json
from math import ceil
from pathlib import Path

import numpy as np

from pneuarm.controllers.arm.arm import CHAMBER_ANGLES_RAD, Arm, Array
from pneuarm.hardware.emulation.faults import EmulatedFaults
from pneuarm.hardware.simulator.flow_valves import valve_of
from pneuarm.hardware.simulator.parameters import NOMINAL, SimulatorParameters, draw
from pneuarm.hardware.simulator.pneumatics import Chamber
from pneuarm.hardware.simulator.rod import Rod

LARGEST_STEP_S = 2.5e-3

#: After a longer silence (s) the air is at rest, or nearly: only this much of it is calculated.
_LONGEST_ADVANCE_S = 2.0

#: The supply stands this much above the arm's largest pressure.
_SUPPLY_OVER_LARGEST = 1.25


class DeviceRecord:
    """What has reached an emulated device, one JSON object a line; the judge of a fault campaign.

    ``{"time_s", "why", "setpoints_pa"}`` at every change of the setpoints and every event of the
    terminal's watchdog, ``{"time_s", "measured_pa", "true_pa"}`` at RATE_HZ; flat lists.
    """

    RATE_HZ = 50.0

    def __init__(self, path: Path) -> None:
        self._file = path.open("w", buffering=1)
        self._last: tuple[str, list[float]] | None = None
        self._sampled_s = -np.inf

    def setpoints(self, time_s: float, why: str, setpoints_pa: Array) -> None:
        """Write the setpoints down if they, or their reason, have changed."""
        entry = (why, setpoints_pa.reshape(-1).tolist())
        if entry != self._last:
            self._last = entry
            self._write({"time_s": time_s, "why": why, "setpoints_pa": entry[1]})

    def sample(self, time_s: float, measured_pa: Array, true_pa: Array) -> None:
        """Write the pressures down, at most RATE_HZ times a second."""
        if time_s - self._sampled_s >= 1.0 / self.RATE_HZ:
            self._sampled_s = time_s
            read = [None if np.isnan(p) else p for p in measured_pa.reshape(-1).tolist()]
            true = true_pa.reshape(-1).tolist()
            self._write({"time_s": time_s, "measured_pa": read, "true_pa": true})

    def _write(self, entry: dict[str, object]) -> None:
        self._file.write(json.dumps(entry) + "\n")


class EmulatedArm:
    """Arm, valves, chambers and sensors behind an emulated terminal; chambers ``(n_sections, 3)``.

    ``setpoints_pa`` is what the terminal was last told, by its host or by its own watchdog.
    """

    def __init__(
        self,
        arm: Arm,
        seed: int,
        record: DeviceRecord | None = None,
        nominal: SimulatorParameters = NOMINAL["servo"],
    ) -> None:
        drawn = draw(nominal, seed, arm.n_sections)
        self._arm, self._values, self._record = arm, drawn.values, record
        self._rod = Rod(arm, drawn)
        self._valve = valve_of(arm, drawn.values)
        self._chamber = Chamber(arm, drawn.values)
        self._shape = (arm.n_sections, 3)
        self._noise = np.random.Generator(np.random.PCG64([seed, 1]))
        largest_pa = float(arm.per_chamber("pressure_max_pa").max())
        self.faults = EmulatedFaults(arm.n_chambers, _SUPPLY_OVER_LARGEST * largest_pa, seed)
        self._time_s: float | None = None
        self.setpoints_pa = np.zeros(self._shape)
        self.true_pressures_pa = np.zeros(self._shape)
        self.pressures_pa = self._read()

    @property
    def n_chambers(self) -> int:
        """Number of chambers, and of valves that move something."""
        return self._arm.n_chambers

    @property
    def supply_pa(self) -> float:
        """Gauge pressure before the valves."""
        return self.faults.supply_pa

    @property
    def stop_pressed(self) -> bool:
        """Whether the terminal's own stop input is pressed; it empties the chambers."""
        return self.faults.stop_pressed

    @property
    def lengths_m(self) -> Array:
        """True lengths of the chambers, along their sub-segments."""
        pieces = self._values.segments_per_section
        shapes = self._rod.shapes.reshape(self._arm.n_sections, pieces, 3).sum(axis=1)
        offset_m = self._arm.per_section("chamber_offset_m")
        cosine, sine = np.cos(CHAMBER_ANGLES_RAD), np.sin(CHAMBER_ANGLES_RAD)
        bending = shapes[:, 1:2] * cosine + shapes[:, 2:3] * sine
        return np.asarray(shapes[:, :1] - offset_m * bending)

    def tip(self) -> tuple[Array, Array]:
        """True tip pose: position (3,) in m and rotation (3, 3), in the base frame."""
        return self._rod.tip()

    def inject(self, words: str) -> None:
        """Break something, or ``clear`` it; see :mod:`pneuarm.hardware.emulation.faults`."""
        self.faults.inject(words)

    def set_pressures_pa(self, pressures_pa: Array, time_s: float, why: str = "write") -> None:
        """Take gauge setpoints (n_sections, 3) that have arrived at ``time_s``."""
        self.setpoints_pa = np.array(pressures_pa, dtype=np.float64).reshape(self._shape)
        self._valve.command(self.setpoints_pa, time_s)
        self._note(time_s, why)

    def zero_all(self, time_s: float, why: str) -> None:
        """Set every output to zero, for the terminal's own watchdog or stop."""
        self.setpoints_pa = np.zeros(self._shape)
        self._valve.vent(time_s)
        self._note(time_s, why)

    def note(self, time_s: float, why: str) -> None:
        """Write an event down that changes no setpoint."""
        self._note(time_s, why)

    def _note(self, time_s: float, why: str) -> None:
        if self._record is not None:
            self._record.setpoints(time_s, why, self.setpoints_pa)

    def advance(self, time_s: float) -> None:
        """Let the physics go on to ``time_s``, and read the sensors; a time gone by is ignored."""
        if self._time_s is None:
            self._time_s = time_s
        from_s = max(self._time_s, time_s - _LONGEST_ADVANCE_S)
        if time_s <= from_s:
            return
        steps = ceil((time_s - from_s) / LARGEST_STEP_S)
        for index in range(steps):
            start_s = from_s + (time_s - from_s) * index / steps
            self._step(start_s, from_s + (time_s - from_s) * (index + 1) / steps)
        self._time_s = time_s
        self.pressures_pa = self._read()
        if self._record is not None:
            self._record.sample(time_s, self.pressures_pa, self.true_pressures_pa)

    def _step(self, start_s: float, end_s: float) -> None:
        before_pa = self.true_pressures_pa.reshape(-1)
        self._valve.advance(start_s, end_s)
        healthy_pa = self._valve.pressures_pa.reshape(-1)
        bent_pa = self.faults.bend_air(before_pa, healthy_pa, end_s - start_s)
        self.true_pressures_pa = self._valve.pressures_pa = bent_pa.reshape(self._shape)
        self._chamber.advance(self.true_pressures_pa, end_s - start_s)
        self._rod.step(self._chamber.lengthening_m.reshape(-1), end_s - start_s)

    def _read(self) -> Array:
        noise_pa = self._noise.normal(0.0, self._values.sensor_noise_pa, self._arm.n_chambers)
        read_pa = self.faults.bend_reading(self.true_pressures_pa.reshape(-1) + noise_pa)
        return read_pa.reshape(self._shape)
