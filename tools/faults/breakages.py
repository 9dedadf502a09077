"""Every way in which the tests break the arm, and which fault must be found.

`python -m tools.faults.breakages` prints how fast, over twenty drawn arms and all
presets, and that the fastest legal moves of a whole arm raise nothing.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from statistics import median

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.controllers.targets.targets import (
    LengthsTarget,
    PositionTarget,
    PressuresTarget,
    Target,
    TwistTarget,
)
from pneuarm.hardware.interface import Measurement
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.safety.faults import FAULTS
from tools.rig.faulty import Faulty
from tools.rig.simulated import Bench

#: A device that answers 50 times a second and rounds to a millibar.
SLOW_AND_COARSE = {"rate_hz": 50.0, "step_pa": 100.0}

#: Devices to raise no alarm with: exact, slow and coarse (50 Hz, a millibar), with length sensors.
DEVICES: tuple[dict[str, object], ...] = (
    {},
    {"rate_hz": 50.0, "step_pa": 100.0},
    {"has_lengths": True},
)

PRESETS = ("paper", "table1", "trunk")


def bench_of(preset: str, seed: int, **device: object) -> tuple[Bench, Faulty]:
    """An arm behind a device that can be broken."""
    bench = Bench(preset, rate_hz=200.0 if preset == "trunk" else 250.0, seed=seed)
    faulty = Faulty(bench.hardware.device, bench.arm, **device)  # type: ignore[arg-type]
    bench.hardware.device = faulty
    return bench, faulty


# --- the ways to break it ----------------------------------------------------------------------


@dataclass(frozen=True)
class Breakage:
    """What breaks at a time, and the fault that must be found for it."""

    code: str
    do: Callable[[Bench, Faulty], None]
    holds: bool = False


def chamber_of(measurement: Measurement, value_pa: float) -> Measurement:
    """The first chamber reads something else."""
    pressures = measurement.pressures_pa.copy()
    pressures[0, 0] = value_pa
    return replace(measurement, pressures_pa=pressures)


def stuck_valve(bench: Bench, faulty: Faulty) -> None:
    stuck_pa = float(bench.newest["pressure_sent_pa"][0, 0])

    def write(pressures_pa: Array) -> Array:
        given = pressures_pa.copy()
        given[0, 0] = stuck_pa
        return given

    faulty.alter_write = write


def burst_tube(bench: Bench, faulty: Faulty) -> None:
    broken_s = bench.now_s

    def read(measurement: Measurement, time_s: float) -> Measurement:
        left = np.exp(-(time_s - broken_s) / 0.1)
        return chamber_of(measurement, left * float(measurement.pressures_pa[0, 0]))

    faulty.alter = read


def leak(bench: Bench, faulty: Faulty) -> None:
    broken_s = bench.now_s

    def read(measurement: Measurement, time_s: float) -> Measurement:
        left = np.exp(-(time_s - broken_s) / 10.0)  # a tenth in a second
        return replace(measurement, pressures_pa=left * measurement.pressures_pa)

    faulty.alter = read


def valve_open_to_supply(bench: Bench, faulty: Faulty) -> None:
    broken_s = bench.now_s

    def read(measurement: Measurement, time_s: float) -> Measurement:
        left = np.exp(-(time_s - broken_s) / 0.1)
        own = float(measurement.pressures_pa[0, 0])
        return chamber_of(measurement, 2e5 + left * (own - 2e5))

    faulty.alter = read


def frozen_sensor(bench: Bench, faulty: Faulty) -> None:
    frozen_pa = float(bench.newest["pressure_measured_pa"][0, 0])
    faulty.alter = lambda measurement, time_s: chamber_of(measurement, frozen_pa)


def reading(value_pa: float) -> Callable[[Bench, Faulty], None]:
    def do(bench: Bench, faulty: Faulty) -> None:
        faulty.alter = lambda measurement, time_s: chamber_of(measurement, value_pa)

    return do


def always(**changes: object) -> Callable[[Bench, Faulty], None]:
    def do(bench: Bench, faulty: Faulty) -> None:
        faulty.alter = lambda measurement, time_s: replace(measurement, **changes)  # type: ignore[arg-type]

    return do


def silent_device(bench: Bench, faulty: Faulty) -> None:
    last = faulty.newest
    assert last is not None
    faulty.alter = lambda measurement, time_s: last


def failing(error: Exception) -> Callable[[Bench, Faulty], None]:
    def do(bench: Bench, faulty: Faulty) -> None:
        def read(measurement: Measurement, time_s: float) -> Measurement:
            raise error

        faulty.alter = read

    return do


def lengths_off(metres: float) -> Callable[[Bench, Faulty], None]:
    def do(bench: Bench, faulty: Faulty) -> None:
        def read(measurement: Measurement, time_s: float) -> Measurement:
            lengths = measurement.lengths_m.copy()
            lengths[0, 0] += metres
            return replace(measurement, lengths_m=lengths)

        faulty.alter = read

    return do


def length_stands(bench: Bench, faulty: Faulty) -> None:
    """It stands where it is, with a little noise."""
    newest, rng = faulty.newest, np.random.default_rng(0)
    assert newest is not None
    stands_m = float(newest.lengths_m[0, 0])

    def read(measurement: Measurement, time_s: float) -> Measurement:
        lengths = measurement.lengths_m.copy()
        lengths[0, 0] = stands_m + rng.normal(0.0, 1e-4)
        return replace(measurement, lengths_m=lengths)

    faulty.alter = read


def foreign_setpoint(bench: Bench, faulty: Faulty) -> None:
    def read(measurement: Measurement, time_s: float) -> Measurement:
        assert measurement.setpoints_pa is not None
        return replace(measurement, setpoints_pa=measurement.setpoints_pa + 0.3e5)

    faulty.alter = read


def tip_off(bench: Bench, faulty: Faulty) -> None:
    length_m = bench.arm.total_rest_length_m
    bench.tip_pose = lambda: bench.newest["tip_true_position_m"] + [1.5 * length_m, 0.0, 0.0]


def overruns(bench: Bench, faulty: Faulty) -> None:
    bench.overruns_per_tick = 0.2


BREAKAGES: dict[str, Breakage] = {
    "the device's call fails": Breakage(
        "device_lost", failing(HardwareError("no answer from the device"))
    ),
    "a mistake in the program": Breakage("tick_failed", failing(KeyError("x"))),
    "the device answers no more": Breakage("measurement_old", silent_device),
    "the device stays silent": Breakage("device_lost", silent_device),
    "a sensor's wire breaks": Breakage("sensor_invalid", reading(np.nan)),
    "a sensor reads -3 bar": Breakage("sensor_invalid", reading(-3e5)),
    "a sensor freezes": Breakage("sensor_frozen", frozen_sensor),
    "a valve opens to the supply": Breakage("overpressure", valve_open_to_supply),
    "a valve is stuck": Breakage("pressure_deviates", stuck_valve),
    "a tube bursts": Breakage("pressure_deviates", burst_tube),
    "a leak of 10 % in a second": Breakage("leak", leak, holds=True),
    "the supply falls to 0.8 bar": Breakage("supply_low", always(supply_pa=0.8e5)),
    "a length sensor slips 90 mm": Breakage("model_contradicted", lengths_off(0.09)),
    "a length sensor stands still": Breakage("model_contradicted", length_stands),
    "the tip is measured elsewhere": Breakage("model_contradicted", tip_off),
    "a length is estimated at 0.7 m": Breakage("estimate_diverges", lengths_off(0.5)),
    "a fifth of deadlines is missed": Breakage("loop_overruns", overruns),
    "another program sets pressures": Breakage("setpoint_foreign", foreign_setpoint),
    "the device complains": Breakage("device_complains", always(complaints=("undervoltage",))),
    "the stop input is pressed": Breakage("stop_pressed", always(stop_pressed=True)),
}


# --- moving and waiting ------------------------------------------------------------------------


def wave(bench: Bench, begin_s: float) -> PressuresTarget:
    """All chambers up and down through most of their range, each with its own phase, at 0.6 Hz."""
    low, high = bench.arm.per_chamber("pressure_min_pa"), bench.arm.per_chamber("pressure_max_pa")
    phases = np.arange(low.size).reshape(low.shape) * 2.1
    share = 0.5 + 0.4 * np.sin(2.0 * np.pi * 0.6 * (bench.now_s - begin_s) + phases)
    return PressuresTarget(low + share * (high - low))


def follow(bench: Bench, seconds: float, until: Callable[[], bool] = lambda: False) -> None:
    """Follow the wave for some time, or until something is so."""
    begin_s = bench.now_s
    while bench.now_s - begin_s < seconds and not until():
        bench.tick(bench.target(wave(bench, 0.0)))


def detection_s(preset: str, seed: int, name: str, at_most_s: float = 6.0) -> tuple[float, Bench]:
    """Break a moving arm; return how long it takes until the fault is told, and the arm."""
    breakage = BREAKAGES[name]
    bench, faulty = bench_of(preset, seed, has_lengths="length" in name)
    bench.tip_pose = lambda: bench.newest["tip_true_position_m"]
    bench.activate()
    follow(bench, 0.8 + 0.08 * seed)
    if breakage.holds:
        bench.ask(ModeEvent.HOLD)
        bench.run(1.0)
    assert not FAULTS.keys() & set(bench.codes()), bench.codes()
    broken_s, code = bench.now_s, breakage.code
    breakage.do(bench, faulty)
    while code not in bench.codes():
        assert bench.now_s - broken_s < at_most_s, f"{name} was not found"
        bench.tick(*(() if breakage.holds else (bench.target(wave(bench, 0.0)),)))
    return bench.now_s - broken_s, bench


def fastest(bench: Bench, rng: np.random.Generator) -> Target:
    """A target that drives the arm as fast as its limits allow."""
    arm = bench.arm
    low, high = arm.per_chamber("pressure_min_pa"), arm.per_chamber("pressure_max_pa")
    kind = rng.integers(5)
    if kind == 0:
        return PressuresTarget(rng.uniform(low, high))
    if kind == 1:
        return PressuresTarget(np.where(rng.random(low.shape) < 0.5, low, high))
    if kind == 2:
        return LengthsTarget(
            rng.uniform(arm.per_chamber("length_min_m"), arm.per_chamber("length_max_m"))
        )
    if kind == 3:
        return PositionTarget(rng.normal(size=3) * arm.max_length_m * 0.6)
    return TwistTarget(rng.normal(size=3), None, False, False)


def false_alarms(preset: str, seed: int, seconds: float, **device: object) -> list[str]:
    """Drive a whole arm as fast as it may go, with holds and vents between; return what is told."""
    bench, _ = bench_of(preset, seed, **device)
    bench.tip_pose = lambda: bench.newest["tip_true_position_m"]
    rng = np.random.default_rng(seed)
    bench.activate()
    end_s, target = bench.now_s + seconds, fastest(bench, rng)
    while bench.now_s < end_s:
        if rng.random() < 0.01:
            target = fastest(bench, rng)
        dice = rng.random()
        if bench.mode == Mode.READY or (bench.mode == Mode.HOLD and dice < 0.005):
            bench.ask(ModeEvent.ENABLE)
        elif bench.mode == Mode.ACTIVE and dice < 0.002:
            bench.ask(ModeEvent.HOLD if dice < 0.001 else ModeEvent.VENT)
        else:
            bench.tick(bench.target(target))
    return [code for code in bench.codes() if code in FAULTS]


def main() -> None:
    """Print the figures of docs/safety.md."""
    seeds = range(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
    for preset in PRESETS:
        found = [
            (seed, told)
            for seed in seeds
            for kind in DEVICES
            if (told := false_alarms(preset, seed, 8.0, **kind))
        ]
        runs = len(seeds) * len(DEVICES)
        print(f"{preset}: false alarms in {runs} runs of 8 s: {found}", flush=True)
    for name, breakage in BREAKAGES.items():
        times = [detection_s(preset, seed, name)[0] for preset in PRESETS for seed in seeds]
        print(
            f"| {name} | `{breakage.code}` | {1e3 * median(times):.0f} | {1e3 * max(times):.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
