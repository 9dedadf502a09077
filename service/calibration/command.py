"""`pneuarm calibrate`: move, record, fit, write."""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from pneuarm.controllers.calibration.calibrate import Calibration, calibrate
from pneuarm.controllers.calibration.pace import Pace
from pneuarm.controllers.calibration.plan import duration_s, plan
from pneuarm.controllers.calibration.recording import Recording
from pneuarm.hardware.tables.table import BAR
from pneuarm.service.calibration import broken_off
from pneuarm.service.calibration.drive import Progressed, ask, progress, record, require_tip
from pneuarm.service.calibration.files import calibrated, require_folder, toml_text, write_whole
from pneuarm.service.calibration.motion import first_moves, pace_after
from pneuarm.service.calibration.page import page
from pneuarm.service.calibration.recordings import read_logs, require_seen
from pneuarm.service.calibration.values import (
    direction_deg,
    errors_mm,
    held_out_mm,
    residuals_text,
    value_text,
    values,
    worth_text,
)
from pneuarm.service.client.client import Client
from pneuarm.service.configuration.configuration import Configuration, recorded
from pneuarm.service.pictures.pyplot import pyplot

#: Ramps up to this are told (Pa/s): those of the plan go faster.
_UNHURRIED_PA_S = 5e4

_TOML, _PAGE = "calibration.toml", "calibration.html"


def run(arguments: argparse.Namespace) -> int:
    """Calibrate from a running daemon, or from logs; write the configuration and the page."""
    folder: Path = arguments.out
    require_folder(folder)
    pyplot()  # for the page: said before the arm moves for nothing
    configuration, recording = (
        read_logs(arguments.from_logs, arguments.arm) if arguments.from_logs else _live(arguments)
    )
    print("fitting ...", file=sys.stderr, flush=True)
    found = calibrate(configuration.build_arm(), recording, arguments.world)
    text = toml_text(configuration, found)
    write_whole(folder / _PAGE, page(found))
    write_whole(folder / _TOML, text)
    broken_off.remove(folder)
    _tell(arguments, found, folder)
    if found.fit.in_world and not arguments.json:
        frame = calibrated(configuration, found).frames.mocap_frame
        print(f"with it, tip poses must come in under the frame {frame!r}: see its [frames]")
    return 0


def _live(arguments: argparse.Namespace) -> tuple[Configuration, Recording]:
    name = arguments.arm or "paper"
    with Client(name, arguments.connect, "calibrate", arguments.zenoh_config) as client:
        configuration = recorded(client.info().config_toml, "the daemon")
        folder = arguments.out
        so_far = broken_off.load(folder, configuration) if arguments.resume else Progressed()
        require_tip(client)
        recording = _moved(client, configuration, so_far, folder)
    require_seen(recording)
    return configuration, recording


def _moved(
    client: Client, configuration: Configuration, so_far: Progressed, folder: Path
) -> Recording:
    """Go through all moves that are not done: the gentle ones, then those that follow from them."""
    arm, (first, slowly) = configuration.build_arm(), first_moves(configuration)
    _say(
        f"arm {arm.name} moves: first by small steps, to see what its valves do, then through most "
        "of its workspace; keep it free; Ctrl-C ends it with the arm vented"
    )
    if so_far.moves_done < len(first):
        record(client, first, configuration, progress(), ask, so_far, slowly)
    pace = pace_after(configuration, so_far.recording)
    moves = [*first, *plan(arm, pace)]
    left = moves[so_far.moves_done :]
    _say(f"{len(left)} places in {duration_s(left):.0f} s or more{_because(pace)}")
    try:
        return record(client, moves, configuration, progress(), ask, so_far, pace)
    except BaseException:
        _keep(folder, configuration, so_far, len(moves))
        raise


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _because(pace: Pace) -> str:
    """Say why an arm moves slowly, where it does."""
    if max(pace.rising_pa_s, pace.falling_pa_s) > _UNHURRIED_PA_S:
        return ""
    return (
        f", with ramps up at {pace.rising_pa_s / BAR:.2f} bar/s and down at "
        f"{pace.falling_pa_s / BAR:.2f} bar/s: the valves are slower than [arm.response] says, and "
        "the monitors of the pressures expect what it says; a calibration of the arm as it is "
        "found now will go faster"
    )


def _keep(
    folder: Path, configuration: Configuration, so_far: Progressed, number_of_moves: int
) -> None:
    """Keep what was recorded of a motion that ends early, and say how to go on with it."""
    if not so_far.moves_done:
        return
    broken_off.save(folder, configuration, so_far)
    print(
        f"{so_far.moves_done} of {number_of_moves} moves are kept in {folder / broken_off.NAME}; "
        f"go on with them: pneuarm calibrate --resume --out {folder}",
        file=sys.stderr,
        flush=True,
    )


def _tell(arguments: argparse.Namespace, found: Calibration, folder: Path) -> None:
    if arguments.json:
        print(json.dumps(report(found, folder)))
        return
    print(f"{residuals_text(found)}.\n{worth_text(found)}.")
    for value in values(found):
        print(f"  {value_text(value)}")
    if found.note:
        print(found.note)
    print(f"wrote {folder / _TOML} (use it: pneuarm run {folder / _TOML}) and {folder / _PAGE}")


def report(found: Calibration, folder: Path) -> dict[str, Any]:
    """Everything for programs: residuals, parameters, frames, files."""
    before, after = errors_mm(found)
    frames = found.fit.frames
    return {
        "arm": found.arm.name,
        "rests": len(after),
        "error_before_mm": {"mean": before.mean(), "max": before.max()},
        "error_after_mm": {"mean": after.mean(), "max": after.max()},
        "held_out_mm": {
            "mean": float(np.nanmean(held_out_mm(found))),
            "max": float(np.nanmax(held_out_mm(found))),
        },
        "direction_deg": {
            "before": direction_deg(found.fit.direction_before_rad),
            "after": direction_deg(found.fit.direction_rad),
            "held_out": direction_deg(found.fit.held_out_rad),
        },
        "parameters": [vars(value) for value in values(found)],
        "coupling": [section.coupling for section in found.arm.sections],
        "rotation_base_to_measuring": frames.rotation.tolist(),
        "base_in_measuring_mm": (1e3 * frames.translation_m).tolist(),
        "marker_in_tip_mm": (1e3 * frames.marker_m).tolist(),
        "note": found.note,
        "configuration": str(folder / _TOML),
        "page": str(folder / _PAGE),
    }
