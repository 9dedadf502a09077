"""Runs every benchmark and writes their table with the machine it was made on.

    make bench
    .venv/bin/python -m tools.bench.report --only ik tracking     # the others from their last run

The figures of each benchmark are kept as JSON in `--results` (default: .bench). A figure that was
asked for stands beside what was measured, met or not.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]

#: Modules of tools.bench, and what else each is told.
BENCHMARKS: dict[str, tuple[str, ...]] = {
    "kinematics": (),
    "ik": ("--reach",),
    "calibrated": (),
    "tracking": (),
    "modbus": (),
}

Results = dict[str, Any]


@dataclass(frozen=True)
class Row:
    """One line of the table: what, what was asked for, and how to read what was measured."""

    what: str
    asked: str
    value: Callable[[Results], str]


def run(name: str, folder: Path) -> None:
    """Run one benchmark alone; its progress goes to the terminal, its JSON to the folder."""
    begun_s = time.monotonic()
    print(f"{name} ...", file=sys.stderr, flush=True)
    command = [sys.executable, "-m", f"tools.bench.{name}", *BENCHMARKS[name], "--json"]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.json").write_text(done.stdout)
    print(f"{name}: {time.monotonic() - begun_s:.0f} s", file=sys.stderr, flush=True)


def read(folder: Path) -> Results:
    """Everything that was measured; a benchmark that never ran is missing."""
    return {
        name: json.loads((folder / f"{name}.json").read_text())
        for name in BENCHMARKS
        if (folder / f"{name}.json").exists()
    }


def _us(found: Results, key: str) -> str:
    row = found["ik"][key]
    osqp = f"; OSQP asked in {100 * row['osqp_share']:.0f} % of the steps"
    return f"{row['p50']:.1f} us; p99 {row['p99']:.1f}, p99.9 {row['p999']:.1f}{osqp}"


def _reach(found: Results, key: str) -> str:
    row = found["ik"]["reach"][key]
    return (
        f"{row['reached']} of {row['targets']}, worst {row['worst_error_mm']:.3f} mm; "
        f"{row['steps_median']:.0f} steps of 10 ms (worst {row['steps_worst']}); "
        f"{row['violations']} steps outside a limit"
    )


def _accepted(found: Results, key: str) -> str:
    row = found["ik"]["reach"][key]
    return (
        f"{100 * row['accepted']:.3f} % of {row['asked']}; touched: {', '.join(row['touched'])}; "
        f"{row['violations']} steps outside a limit"
    )


def _out_of_reach(found: Results) -> str:
    row = found["ik"]["reach"]["out_of_reach"]
    return (
        f"{row['within_tolerance']} of {row['targets']}, worst {row['worst_excess_mm']:.3f} mm; "
        f"{row['said_so']} said so and named the limit"
    )


def _peers(found: Results) -> str:
    peers = found["ik"]["peers_us"]
    texts = [f"{name} {value:.0f}" for name, value in sorted(peers.items(), key=lambda p: p[1])]
    return f"{found['ik']['times_faster_than_fastest_peer']:.1f} times; peers (us): " + ", ".join(
        texts
    )


def _pair(row: dict[str, float], unit: str, digits: int = 2) -> str:
    return f"{row['median']:.{digits}f} {unit} median, {row['worst']:.{digits}f} {unit} worst"


def _steady(found: Results, case: str) -> str:
    row = found["tracking"][case]["steady_mm"]
    return f"{_pair(row, 'mm')}, over {row['number']} targets"


def _lost(found: Results) -> str:
    phases = found["tracking"]["calibrated"]["camera_lost"]
    return "; ".join(
        f"{name}: {row['tip_mm']:.3f} mm, {row['pressure_mbar']:.1f} mbar"
        for name, row in phases.items()
    )


def _calibrated(found: Results, which: str) -> str:
    rows = found["calibrated"]["rows"]
    means = [row[f"{which}_percent"]["mean"] for row in rows]
    return (
        f"{sum(means) / len(means):.2f} % of the length in the mean, worst arm {max(means):.2f} %"
    )


ROWS = (
    Row("forward kinematics with Jacobian, soromox's time over ours", "15 times",
        lambda f: f"{f['kinematics']['fk_jacobian_times_faster']:.1f} times"),
    Row("batch forward kinematics, soromox's vmap over ours", "8 times",
        lambda f: f"{f['kinematics']['batch_fk_times_faster']:.1f} times"),
    Row("batch of three sections over one section", "at most 4",
        lambda f: f"{f['kinematics']['three_sections_times_slower']:.1f}"),
    Row("one inverse-kinematics step, one section", "15 us", lambda f: _us(f, "ik_us")),
    Row("the same at the limits", "", lambda f: _us(f, "ik_at_limits_us")),
    Row("three sections", "25 us, p99 60 us", lambda f: _us(f, "ik_3_sections_us")),
    Row("three sections at the limits", "", lambda f: _us(f, "ik_at_limits_3_sections_us")),
    Row("six sections", "40 us", lambda f: _us(f, "ik_6_sections_us")),
    Row("six sections at the limits", "", lambda f: _us(f, "ik_at_limits_6_sections_us")),
    Row("the fastest peer's time over ours, one section", "3 times", _peers),
    Row("QP results accepted, every limit active, one section", "99.9 %",
        lambda f: _accepted(f, "accepted_one_section")),
    Row("the same, three sections", "99.9 %", lambda f: _accepted(f, "accepted_three_sections")),
    Row("random reachable positions, within 0.1 mm", "all", lambda f: _reach(f, "reachable")),
    Row("the same, three sections", "", lambda f: _reach(f, "reachable_three_sections")),
    Row("at and around the straight arm", "all", lambda f: _reach(f, "around_the_straight_arm")),
    Row("out of reach: the nearest point within 0.1 mm of a global search", "all", _out_of_reach),
    Row("tip at rest, uncalibrated, no feedback", "for comparison",
        lambda f: _calibrated(f, "before")),
    Row("tip at rest, calibrated, no feedback", "3 %, and a third of the above",
        lambda f: _calibrated(f, "after")),
    Row("with the tip measured: steady error", "0.3 mm median, 0.6 mm worst",
        lambda f: _steady(f, "calibrated")),
    Row("the same on an uncalibrated arm", "", lambda f: _steady(f, "uncalibrated")),
    Row("step of 50 mm, settled to 1 mm", "1 s median",
        lambda f: _pair(f["tracking"]["calibrated"]["step"]["settled_s"], "s")),
    Row("its overshoot", "5 %",
        lambda f: _pair(f["tracking"]["calibrated"]["step"]["overshoot_percent"], "%", 1)),
    Row("circle of radius 40 mm at 0.25 Hz, RMS", "1.5 mm",
        lambda f: _pair(f["tracking"]["calibrated"]["circle_rms_mm"], "mm")),
    Row("the same without the camera", "",
        lambda f: _pair(f["tracking"]["calibrated_no_feedback"]["circle_rms_mm"], "mm")),
    Row("camera lost for 2 s in the circle: largest jump of the command in a tick", "", _lost),
    Row("Modbus TCP, one block write and one block read", "",
        lambda f: f"{f['modbus']['exchanges_per_s']:.0f} a second on loopback, "
        f"{f['modbus']['share_of_library']:.2f} of the bare library's rate"),
)  # fmt: skip


def machine() -> str:
    """What it was measured on."""
    names = [
        line.split(":", 1)[1].strip()
        for line in Path("/proc/cpuinfo").read_text().splitlines()
        if line.startswith("model name")
    ]
    cores = len(os.sched_getaffinity(0))
    return (
        f"{names[0] if names else platform.machine()}, {cores} cores, "
        f"Linux {platform.release().split('-')[0]}, Python {platform.python_version()}, "
        f"{time.strftime('%Y-%m-%d')}"
    )


_HEAD = (
    "# Benchmarks",
    "",
    "Written by `make bench`; nothing is typed in. Times are compared within one run, because a",
    "machine's are its own; the rest runs the real loop in simulated time against simulated arms",
    "whose parameters vary by 20 %. What is not met is left as it was measured.",
)


def page(found: Results) -> str:
    """The page; a row whose benchmark never ran says so."""
    lines = [*_HEAD, "", f"Machine: {machine()}.", ""]
    lines += ["| what | asked for | measured |", "|---|---|---|"]
    for row in ROWS:
        try:
            value = row.value(found)
        except KeyError as error:
            value = f"not measured ({error.args[0]})"
        lines.append(f"| {row.what} | {row.asked} | {value} |")
    programs = ", ".join(f"`{name}.py`" for name in BENCHMARKS)
    lines += ["", "How a figure is taken stands at the head of its program in `tools/bench/`:"]
    lines += [f"{programs}."]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run, then write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", choices=BENCHMARKS, default=list(BENCHMARKS))
    parser.add_argument("--results", type=Path, default=ROOT / ".bench")
    parser.add_argument("--write", type=Path, metavar="PAGE.md")
    arguments = parser.parse_args()
    for name in arguments.only:
        run(name, arguments.results)
    text = page(read(arguments.results))
    if arguments.write:
        arguments.write.write_text(text)
    print(text)


if __name__ == "__main__":
    main()
