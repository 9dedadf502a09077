"""States for people: millimetres, degrees and bar."""

import math
from collections.abc import Iterable

from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.printable import name_of
from pneuarm.service.client.moving import out_of_reach


def millimetres(values_m: Iterable[float]) -> str:
    """Format metres as millimetres."""
    return "(" + ", ".join(f"{1e3 * value:.1f}" for value in values_m) + ")"


def bars(values_pa: Iterable[float]) -> str:
    """Format pascal as bar."""
    return "(" + ", ".join(f"{1e-5 * value:+.3f}" for value in values_pa) + ")"


def state_line(state: pb.ArmState) -> str:
    """One line: number, mode, tip, target, lengths, pressures."""
    parts = [
        f"#{state.sequence}",
        name_of(pb.Mode, state.mode),
        f"tip {millimetres(state.tip_estimated_position_m)} mm",
    ]
    if state.target_kind != pb.NO_TARGET:
        kind = name_of(pb.TargetKind, state.target_kind)
        reach = name_of(pb.Reach, state.reach).replace("_", " ")
        goal = f" {millimetres(state.target_position_m)} mm" if state.target_position_m else ""
        parts.append(f"{kind}{goal} {reach}, error {1e3 * state.target_error_m:.2f} mm")
    parts.append(f"lengths {millimetres(state.length_estimated_m)} mm")
    parts.append(f"pressures {bars(state.pressure_measured_pa)} bar")
    if state.log_missed:
        parts.append(f"THE LOG LACKS {state.log_missed} records")
    return "  ".join(parts)


def outcome(state: pb.ArmState) -> str:
    """Say how a target ended: reached, or out of reach and why, and how near."""
    tip = millimetres(state.tip_estimated_position_m)
    error = 1e3 * state.target_error_m
    if state.reach == pb.REACHED:
        return f"reached: tip at {tip} mm (estimated), commanded error {error:.2f} mm"
    return str(out_of_reach(state))


def radians(values_deg: list[float] | None) -> list[float] | None:
    """Convert degrees."""
    return None if values_deg is None else [math.radians(value) for value in values_deg]
