"""Gain and delay margins of the correction: what an arm may lack of its model until it swings.

    .venv/bin/python -m tools.bench.margins

In simulated time, with the real loop: the arm's lengthening per pressure is larger than the model's
by a factor, or its valves wait longer than they are told to, until the tip swings where it is to
stand, or the correction is turned down because it has. The first step of each scale at which that
is so is told, null where it is on none.
"""

import argparse
import json
from collections.abc import Iterable
from dataclasses import replace

from pneuarm.service.configuration.configuration import Configuration
from tools.bench.random_arms import PLACES_M, STAND_S, TO_S, Drawn, configured, swing_of
from tools.bench.rig import CameraRig

GAINS = (1.5, 2.0, 3.0)
DELAYS_S = (0.05, 0.1, 0.2, 0.3)
#: Lags of filling and exhausting, dead time (s).
VALVES = {
    "servo": (0.06, 0.06, 0.005),
    "slow": (0.2, 0.6, 0.03),
    "slower": (0.45, 1.6, 0.06),
}
_CAMERA_HZ, _CAMERA_LATE_S = 100.0, 0.01


def _longer(configuration: Configuration, gain: float) -> Configuration:
    """Return what simulates an arm that lengthens more than its model."""
    tables = configuration.model_dump(exclude_none=True)
    tables["simulator"]["arm"]["sections"][0]["lengthening_mm_per_bar"] *= gain
    return Configuration.model_validate(tables)


def swings(told: Drawn, true: Drawn, gain: float) -> bool:
    """Whether such an arm swings at the first place, or has before it was turned down."""
    configuration = configured(told)
    device = true.device(_longer(configuration, gain))
    rig = CameraRig(configuration, device=device).activate()
    rig.to(PLACES_M[0], TO_S)
    swing_m = swing_of(rig.to(PLACES_M[0], STAND_S)["tip_true_position_m"])
    return swing_m > 0.0 or any(event.code == "correction_swings" for event in rig.events)


def _first(values: Iterable[float], told: Drawn, gains: bool) -> float | None:
    for value in values:
        true = told if gains else replace(told, delay_s=told.delay_s + value)
        if swings(told, true, value if gains else 1.0):
            return value
    return None


def margins(name: str, seed: int) -> dict[str, object]:
    """First gain and delay beyond the model's at which the arm of a seed swings, None for none."""
    told = Drawn(seed, *VALVES[name], _CAMERA_HZ, _CAMERA_LATE_S, hysteresis_known=True)
    gain, delay_s = _first(GAINS, told, gains=True), _first(DELAYS_S, told, gains=False)
    return {"valves": name, "seed": seed, "gain": gain, "delay_s": delay_s}


def main() -> None:
    """Print a line an arm."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[20, 21])
    parser.add_argument("--valves", nargs="+", choices=tuple(VALVES), default=tuple(VALVES))
    arguments = parser.parse_args()
    for name in arguments.valves:
        for seed in arguments.seeds:
            print(json.dumps(margins(name, seed)), flush=True)


if __name__ == "__main__":
    main()
