"""`pneuarm demo`: the whole thing in one command."""

import json
import os
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import pytest

from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.reading.summary import summarise
from pneuarm.service.demo.figures import Figures, table
from tools.rig.daemon import run_command


@pytest.mark.slow
@pytest.mark.timeout(180)  # three daemons and a calibration, one after another
def test_demo_gives_its_figures_and_good_logs(tmp_path: Path) -> None:
    home = {"HOME": str(tmp_path), "XDG_STATE_HOME": str(tmp_path / "state")}
    done = run_command("demo", "--seconds", "4", "--json", env=os.environ | home, timeout=170)
    assert done.returncode == 0, done.stderr
    figures = json.loads(done.stdout)
    assert set(figures) == {field.name for field in fields(Figures)}
    for latency in (figures["wake_us"], figures["compute_us"]):
        assert set(latency) == {"p50", "p99", "max"}
        assert 0.0 <= latency["p50"] <= latency["p99"] <= latency["max"]
    assert figures["missing_records"] == 0
    assert figures["ticks"] > 3000
    assert figures["rate_hz"] > 0.0
    errors = figures["eight_rms_error_mm"]
    assert list(errors) == ["uncalibrated", "calibrated", "feedback"]
    assert errors["uncalibrated"] > max(errors["calibrated"], errors["feedback"])

    paths = [Path(log) for log in figures["logs"]]
    assert len(set(paths)) == 3
    assert sum(path.stat().st_size for path in paths) == figures["log_bytes"]
    for path in paths:
        assert path.is_relative_to(tmp_path / "state")
        assert summarise(LogReader(path)).finished
    assert sum(summarise(LogReader(path)).ticks for path in paths) == figures["ticks"]
    rerun = Path(sys.executable).with_name("rerun")
    checked = subprocess.run(
        [rerun, "mcap", "check", figures["log"]], capture_output=True, text=True, timeout=60
    )
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_demo_too_short_is_one_sentence() -> None:
    done = run_command("demo", "--seconds", "0.2")
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert all(fact in line for fact in ("--seconds", "'0.2'", "from 1 "))


def test_table_tells_how_to_see_it_again() -> None:
    latency = {"p50": 1.0, "p99": 2.0, "max": 3.0}
    errors = {"uncalibrated": 20.0, "feedback": 4.25}
    logs = ["/logs/a.mcap", "/logs/b.mcap"]
    figures = Figures(
        1000, 999.5, 2, latency, latency, 0, 4.25, errors, logs[-1], logs, log_bytes=2_500_000
    )
    text = table(figures)
    for words in ("999.50 Hz, 2 overruns", "20.00 mm", "4.25 mm", "2.5 MB", "2 sessions"):
        assert words in text
    lines = text.splitlines()
    assert lines[-3].endswith("pneuarm replay /logs/a.mcap")
    assert lines[-1].endswith("rerun /logs/b.mcap")


@pytest.mark.parametrize("seconds", ["nan", "-1"])
def test_demo_refuses_what_is_no_time(seconds: str) -> None:
    done = run_command("demo", f"--seconds={seconds}")
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert all(fact in line for fact in ("--seconds", seconds, "from 1 "))
