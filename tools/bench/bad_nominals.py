"""What a calibration makes of a wrong configuration: refused in words, or found all the same.

    .venv/bin/python -m tools.bench.bad_nominals --preset paper

Each number of `[arm]` a tenth and ten times of what it should be, gravity the wrong way, valves
exchanged, the frame of the tip poses turned, a stiff arm, and seeded mixtures of these. The
simulated arm goes through the plan in simulated time; `--quick` takes an even rod that is always at
rest instead. A row is wrong where a fit is accepted that leaves more at places it did not see than
`ALLOWED` times what the right configuration leaves. The exit status is 1 with one of these.
"""

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import PneuarmError
from pneuarm.controllers.calibration.calibrate import calibrate
from pneuarm.controllers.calibration.plan import plan
from pneuarm.controllers.calibration.recording import Recording
from pneuarm.controllers.calibration.worth import held_out_mean_m
from pneuarm.controllers.geometry.rotations import rotation_from_vector
from pneuarm.hardware.interface import Hardware, Measurement
from pneuarm.hardware.simulator.parameters import NOMINAL, Valves
from pneuarm.service.calibration.files import calibrated
from pneuarm.service.calibration.simulated import record_simulated
from pneuarm.service.configuration.configuration import Configuration, check
from pneuarm.service.devices import registry
from tools.rig.foreign_arms import ForeignArm, recording_of, rod_of, sent_by
from tools.rig.simulated import configuration_of

#: A fit that is accepted may leave so many times the error of the right configuration, and this
#: share of the arm's length more.
ALLOWED, ALLOWED_SHARE = 2.0, 0.005

Tables = dict[str, Any]
Change = Callable[[Tables], None]

_SECTION_KEYS = (
    "rest_length_mm",
    "chamber_offset_mm",
    "length_min_mm",
    "length_max_mm",
    "bend_max_deg",
    "length_rate_max_mm_s",
    "pressure_slew_max_bar_s",
    "lengthening_mm_per_bar",
    "softening_mm_per_bar2",
)
_RESPONSE_KEYS = (
    "delay_ms",
    "filling_lag_ms",
    "exhausting_lag_ms",
    "mode_hz",
    "damping_ratio",
)
_ORDERS = ((0, 2, 1), (1, 0, 2), (2, 1, 0), (1, 2, 0), (2, 0, 1))
_TURNS_DEG = ((0, 0, 30), (0, 0, 90), (0, 0, 180), (90, 0, 0), (180, 0, 0), (0, 20, 0))


@dataclass(frozen=True)
class Case:
    """One thing, or some, told wrongly.

    ``change`` is made to the tables of the configuration; ``order`` says which valve feeds each
    chamber, ``turn_deg`` how the frame of the poses is turned, ``stiff`` by what the simulated arm
    lengthens less.
    """

    name: str
    change: Change = lambda tables: None
    order: tuple[int, ...] = (0, 1, 2)
    turn_deg: tuple[float, ...] = (0.0, 0.0, 0.0)
    stiff: float = 1.0


def _scaled(key: str, factor: float) -> Change:
    def change(tables: Tables) -> None:
        for section in tables["arm"]["sections"]:
            if key in section:
                section[key] = factor * section[key]

    return change


def _response(key: str, factor: float) -> Change:
    def change(tables: Tables) -> None:
        tables["arm"]["response"][key] *= factor

    return change


def _arm(key: str, value: Callable[[Any], Any]) -> Change:
    def change(tables: Tables) -> None:
        tables["arm"][key] = value(tables["arm"][key])

    return change


def _times(factor: float, value: Any) -> Any:
    return factor * value if isinstance(value, float) else [factor * each for each in value]


def cases(seeds: int) -> Iterator[Case]:
    """Every case, the right configuration first."""
    yield Case("right")
    for key in _SECTION_KEYS:
        for factor in (0.1, 10.0):
            yield Case(f"{key} x {factor:g}", _scaled(key, factor))
    yield Case("lengthening_mm_per_bar x 12", _scaled("lengthening_mm_per_bar", 12.0))
    for key in _RESPONSE_KEYS:
        for factor in (0.1, 10.0):
            yield Case(f"response.{key} x {factor:g}", _response(key, factor))
    for factor in (0.1, 10.0):
        times = partial(_times, factor)
        yield Case(f"mass_kg x {factor:g}", _arm("mass_kg", times))
        yield Case(f"gravity_m_s2 x {factor:g}", _arm("gravity_m_s2", times))
    yield Case("gravity the other way", _arm("gravity_m_s2", lambda g: [-each for each in g]))
    yield Case("gravity sideways", _arm("gravity_m_s2", lambda g: [g[2], g[0], g[1]]))
    for order in _ORDERS:
        yield Case(f"chambers by valves {[v + 1 for v in order]}", order=order)
    for turn in _TURNS_DEG:
        yield Case(f"poses turned by {list(turn)} deg", turn_deg=turn)
    for stiff in (20.0, 100.0):
        yield Case(f"an arm {stiff:g} times stiffer", stiff=stiff)
    for seed in range(seeds):
        yield _mixture(seed)


def _mixture(seed: int) -> Case:
    """Several numbers wrong at once, by any factor within ten, and perhaps a wrong order."""
    rng = np.random.default_rng([seed, 5])
    keys = ("lengthening_mm_per_bar", "chamber_offset_mm", "softening_mm_per_bar2")
    factors = np.exp(rng.uniform(-np.log(10.0), np.log(10.0), len(keys)))
    turned = bool(rng.uniform() < 0.3)

    def change(tables: Tables) -> None:
        for key, factor in zip(keys, factors.tolist(), strict=True):
            _scaled(key, factor)(tables)
        if turned:
            _arm("gravity_m_s2", lambda g: [-each for each in g])(tables)

    order = _ORDERS[int(rng.integers(len(_ORDERS)))] if rng.uniform() < 0.3 else (0, 1, 2)
    told = ", ".join(f"{k.split('_')[0]} x {f:.2g}" for k, f in zip(keys, factors, strict=True))
    more = f"{', gravity -' if turned else ''}{f', valves {order}' if order != (0, 1, 2) else ''}"
    return Case(f"seed {seed}: {told}{more}", change, order)


class _Exchanged:
    """A device whose valves are exchanged within every section."""

    def __init__(self, device: Hardware, order: tuple[int, ...]) -> None:
        self._device, self._order = device, list(order)
        self._back = np.argsort(self._order)

    def connect(self) -> None:
        self._device.connect()

    def read(self, time_s: float) -> Measurement:
        found = self._device.read(time_s)
        return replace(found, pressures_pa=found.pressures_pa[:, self._back])

    def write(self, pressures_pa: Array, time_s: float) -> Array:
        return self._device.write(pressures_pa[:, self._order], time_s)[:, self._back]

    def vent(self, time_s: float) -> None:
        self._device.vent(time_s)

    def close(self) -> None:
        self._device.close()


class Recorder:
    """Recordings of one arm of the family, each made once: most cases move it in the same way."""

    def __init__(self, preset: str, seed: int, quick: bool, valves: Valves = "servo") -> None:
        self._right, self._quick = configuration_of(preset, 250.0, seed, valves), quick
        self._kept: dict[Any, Recording] = {}

    def configuration(self, case: Case) -> Configuration:
        """The wrong configuration; raises ConfigurationError where it is refused by itself."""
        tables = self._right.model_dump(exclude_none=True)
        arm = self._right.arm.model_dump()
        for section in arm["sections"]:
            section["lengthening_mm_per_bar"] /= case.stiff
            section["softening_mm_per_bar2"] /= case.stiff
        tables["simulator"]["arm"] = arm
        case.change(tables)
        return check(tables, case.name)

    def recording(self, case: Case, configuration: Configuration) -> Recording:
        """What is recorded when that configuration is calibrated."""
        arm = configuration.build_arm()
        moves = b"".join(move.pressures_pa.tobytes() for move in plan(arm))
        limits = tuple(replace(s, lengthening_m_per_pa=1.0) for s in arm.sections)
        key = (moves, case.order, case.stiff, str(limits), str(arm.response))
        if key not in self._kept:
            make = self._at_rest if self._quick else self._simulated
            self._kept[key] = make(case, configuration)
        return _seen(self._kept[key], case)

    def _simulated(self, case: Case, configuration: Configuration) -> Recording:
        device = registry.build(configuration, configuration.build_arm())
        return record_simulated(configuration, _Exchanged(device, case.order))

    def _at_rest(self, case: Case, configuration: Configuration) -> Recording:
        true = configuration.build_simulated_arm()
        sections = tuple(replace(section, hysteresis_pa=2e3) for section in true.sections)
        true = replace(true, sections=sections)
        foreign = ForeignArm(true, rod_of(true, 0.2), (1.1,) * (2 * true.n_sections))
        moves = plan(configuration.build_arm())
        return recording_of(foreign, sent_by(moves, true.n_sections, 0.05), 0.05, case.order)


def _seen(recording: Recording, case: Case) -> Recording:
    """The same seen in a frame that is turned."""
    turn = rotation_from_vector(np.deg2rad(case.turn_deg))
    rotations = recording.tip_rotation
    turned = None if rotations is None else turn @ rotations
    return replace(recording, tip_m=recording.tip_m @ turn.T, tip_rotation=turned)


@dataclass(frozen=True)
class Row:
    """What became of a case: ``share`` of the arm's length left at held-out places, or why not."""

    name: str
    share: float
    refused: str


def judged(recorder: Recorder, case: Case) -> Row:
    """Calibrate a case."""
    try:
        configuration = recorder.configuration(case)
        arm: Arm = configuration.build_arm()
        found = calibrate(arm, recorder.recording(case, configuration))
        calibrated(configuration, found)
    except PneuarmError as error:
        return Row(case.name, np.nan, str(error).replace("\n", "; "))
    true = configuration.build_simulated_arm().total_rest_length_m
    return Row(case.name, held_out_mean_m(found.fit) / true, "")


def is_wrong(row: Row, right: Row) -> bool:
    """Whether a fit was accepted that is much worse than that of the right configuration."""
    return not row.refused and row.share > ALLOWED * right.share + ALLOWED_SHARE


def main() -> int:
    """Judge every case and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--preset", default="paper", choices=("paper", "table1", "trunk"))
    parser.add_argument("--seed", type=int, default=0, help="arm of the family (default 0)")
    parser.add_argument("--mixtures", type=int, default=20)
    parser.add_argument("--valves", choices=tuple(NOMINAL), default="servo")
    parser.add_argument("--quick", action="store_true", help="an even rod, always at rest")
    arguments = parser.parse_args()
    recorder = Recorder(arguments.preset, arguments.seed, arguments.quick, arguments.valves)
    right, counts = Row("", np.nan, ""), {"refused": 0, "found": 0, "WRONG": 0}
    for case in cases(arguments.mixtures):
        row = judged(recorder, case)
        right = row if case.name == "right" else right
        verdict = "WRONG" if is_wrong(row, right) else "refused" if row.refused else "found"
        counts[verdict] += 1
        told = row.refused or f"{100.0 * row.share:.2f} % of the length at held-out places"
        print(f"{verdict:8} {case.name:44} {told}", flush=True)
    print(", ".join(f"{number} {verdict}" for verdict, number in counts.items()))
    return int(counts["WRONG"] > 0 or bool(right.refused))


if __name__ == "__main__":
    sys.exit(main())
