"""`pneuarm workspace`: where the tip can be, as a table, pictures, a mesh and samples."""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

from pneuarm.controllers.actuation.pressure_map import length_bounds_m, pressure_length_bounds_m
from pneuarm.controllers.arm.arm import LENGTH_MARGIN_M, Arm
from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.controllers.workspace.summary import Summary, summarise
from pneuarm.service.configuration.configuration import load
from pneuarm.service.pictures.pyplot import pyplot

_MM, _LITRES = 1e3, 1e3


def workspace(arguments: argparse.Namespace) -> int:
    """Compute, write the files, print the table."""
    arm = load(preset=arguments.arm).build_arm()
    if arguments.out is not None:
        pyplot()  # said before a minute of computing
    summary = summarise(arm, arguments.samples, arguments.seed)
    files = [] if arguments.out is None else _write(arguments.out, summary)
    if arguments.json:
        print(json.dumps(as_dict(summary) | {"files": [str(path) for path in files]}))
    else:
        print("\n".join([*lines(summary), *(f"{'written':<17}{path}" for path in files)]))
    return 0


def _write(folder: Path, summary: Summary) -> list[Path]:
    """Write all files into a folder, which is made."""
    from pneuarm.service.workspace.files import write_npz, write_ply
    from pneuarm.service.workspace.picture import write_png
    from pneuarm.service.workspace.scene import write_rrd

    paths = [folder / f"workspace.{suffix}" for suffix in ("ply", "npz", "rrd", "png")]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_ply(paths[0], summary.mesh, summary.arm.name)
        write_npz(paths[1], summary.samples)
        write_rrd(paths[2], summary)
        write_png(paths[3], summary)
    except OSError as error:
        raise ConfigurationError(f"--out {folder}: {error.strerror or error}") from error
    return paths


def as_dict(summary: Summary) -> dict[str, Any]:
    """Return the summary with the units in the keys."""
    samples = summary.samples
    return {
        "arm": summary.arm.name,
        "exact": summary.exact,
        "volume_litres": _LITRES * summary.volume.value,
        "volume_error_litres": _LITRES * summary.volume.error,
        "volume_method": summary.volume.method,
        "volume_checks": [
            {
                "method": check.method,
                "volume_litres": _LITRES * check.value,
                "error_litres": _LITRES * check.error,
            }
            for check in summary.checks
        ],
        "extents_mm": (_MM * summary.extents_m).tolist(),
        "extents_error_mm": _MM * summary.extents_error_m,
        "furthest_from_base_mm": _MM * summary.furthest_from_base_m,
        "furthest_from_axis_mm": _MM * summary.furthest_from_axis_m,
        "least_radius_over_offset": summary.least_radius.tolist(),
        "manipulability": _spread(samples.manipulability),
        "condition": _spread(samples.condition),
        "limits": _limits(summary.arm),
        "mesh": {
            "outer_hull": summary.mesh.outer_hull,
            "watertight": summary.mesh.is_watertight,
            "vertices": len(summary.mesh.vertices_m),
            "triangles": len(summary.mesh.triangles),
            "volume_litres": _LITRES * summary.mesh.volume_m3,
        },
        "samples": len(samples.positions_m),
    }


def _spread(values: np.ndarray) -> dict[str, float]:
    return {"min": float(values.min()), "mean": float(values.mean()), "max": float(values.max())}


def _limits(arm: Arm) -> list[dict[str, Any]]:
    """Return the limits of every section, and which of two ends the chambers' travel."""
    low, high = length_bounds_m(arm)
    pressure_low, pressure_high = pressure_length_bounds_m(arm)
    return [
        {
            "length_mm": [_MM * low[index, 0], _MM * high[index, 0]],
            "shortest_by": _ends(pressure_low[index, 0] - section.length_min_m),
            "longest_by": _ends(section.length_max_m - pressure_high[index, 0]),
            "bend_max_deg": float(np.rad2deg(section.bend_max_rad)),
        }
        for index, section in enumerate(arm.sections)
    ]


def _ends(inside_m: float) -> str:
    return "pressure" if inside_m > LENGTH_MARGIN_M else "length"


def lines(summary: Summary) -> list[str]:
    """Return the table, a line a figure; millimetres, litres and degrees."""
    how = "exact test" if summary.exact else "numerical: by searches, not exact"
    rows = [("arm", f"{summary.arm.name}, {summary.arm.n_sections} section(s), {how}")]
    for name, figure in [("volume", summary.volume), *(("", check) for check in summary.checks)]:
        value, error = _LITRES * figure.value, _LITRES * figure.error
        rows.append((name, f"{value:.7g} litres, error {error:.1g} ({figure.method})"))
    low, high = _MM * summary.extents_m
    axes = ", ".join(f"{n} {a:.2f} to {b:.2f}" for n, a, b in zip("xyz", low, high, strict=True))
    rows.append(("extents [mm]", f"{axes}, error {_MM * summary.extents_error_m:.1g}"))
    rows.append(("reach [mm]", _reach(summary)))
    for name in ("manipulability", "condition"):
        spread = _spread(getattr(summary.samples, name))
        text = "{min:.3g} to {max:.3g}, mean {mean:.3g}".format(**spread)
        rows.append((name, f"{text} ({len(summary.samples.positions_m)} samples)"))
    rows += [("limits", _limit_text(limits)) for limits in _limits(summary.arm)]
    rows.append(("least radius", _radius(summary)))
    return [f"{name:<17}{text}" for name, text in rows]


def _reach(summary: Summary) -> str:
    base, axis = _MM * summary.furthest_from_base_m, _MM * summary.furthest_from_axis_m
    return f"{base:.2f} from the base, {axis:.2f} from its axis"


def _limit_text(limits: dict[str, Any]) -> str:
    low, high = limits["length_mm"]
    return (
        f"chambers {low:.1f} mm ({limits['shortest_by']}) to {high:.1f} mm "
        f"({limits['longest_by']}), bend {limits['bend_max_deg']:.0f} deg"
    )


def _radius(summary: Summary) -> str:
    least = float(summary.least_radius.min())
    clear = "stay clear of" if least > 1.0 else "would cross"
    return f"{least:.2f} chamber offsets: the chambers {clear} the centre of curvature"
