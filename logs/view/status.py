"""The status panel of the live view: one tick in words."""

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.limits.limits import names
from pneuarm.logs.schema import pneuarm_pb2 as pb

_GUARD = {1: "range", 2: "slew", 4: "not finite", 8: "too old", 16: "supply"}


def status_markdown(tick: np.void) -> str:
    """Return the panel's text for one tick."""
    rows = {
        "Target": _target(tick),
        "Reach": f"{_words(pb.Reach.Name(int(tick['reach'])))}, "
        f"by {_words(pb.Law.Name(int(tick['law'])))}",
        "Tip error, mm": _errors(tick),
        "Binding limits": ", ".join(names(int(tick["binding_limits"]))) or "none",
        "Guard": f"{_bits(int(tick['guard_intervention']), _GUARD)}, "
        f"{int(tick['guard_interventions'])} interventions so far",
        "Overruns": f"{int(tick['overruns'])} so far",
    }
    lines = [f"| {name} | {text} |" for name, text in rows.items()]
    mode = pb.Mode.Name(int(tick["mode"]))
    return "\n".join([f"| Mode | {mode} |", "|---|---|", *lines])


def _target(tick: np.void) -> str:
    kind = _words(pb.TargetKind.Name(int(tick["target_kind"])))
    position_m = tick["target_position_m"]
    if np.isnan(position_m).any():
        return kind
    x, y, z = (1e3 * position_m).tolist()
    return f"{kind} ({x:.1f}, {y:.1f}, {z:.1f}) mm, {1e3 * float(tick['target_age_s']):.0f} ms old"


def _errors(tick: np.void) -> str:
    texts = [
        f"{tip} {_distance_mm(tick, tip):.1f}"
        for tip in ("true", "measured", "estimated", "commanded")
        if not np.isnan(_distance_mm(tick, tip))
    ]
    return ", ".join(texts) or "-"


def _distance_mm(tick: np.void, tip: str) -> float:
    miss_m: Array = tick[f"tip_{tip}_position_m"] - tick["target_position_m"]
    return 1e3 * float(np.sqrt(miss_m @ miss_m))


def _words(name: str) -> str:
    return name.lower().replace("_", " ")


def _bits(value: int, names: dict[int, str]) -> str:
    return ", ".join(name for bit, name in names.items() if value & bit) or "none"
