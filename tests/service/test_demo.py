"""`pneuarm demo`: the whole thing in one command."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from logs.reader import LogReader, summarise
from service import demo
from tests.service.daemon import run_command


def test_demo_gives_its_figures_and_a_good_log(tmp_path: Path) -> None:
    home = {"HOME": str(tmp_path), "XDG_STATE_HOME": str(tmp_path / "state")}
    done = run_command("demo", "--seconds", "4", "--json", env=os.environ | home)
    assert done.returncode == 0, done.stderr
    figures = json.loads(done.stdout)
    assert set(figures) == {
        *("ticks", "rate_hz", "overruns", "wake_us", "compute_us", "missing_records"),
        *("tip_rms_error_mm", "log", "log_bytes"),
    }
    for latency in (figures["wake_us"], figures["compute_us"]):
        assert set(latency) == {"p50", "p99", "max"}
        assert 0.0 <= latency["p50"] <= latency["p99"] <= latency["max"]
    assert figures["missing_records"] == 0
    assert figures["ticks"] > 3000
    assert figures["rate_hz"] > 0.0
    assert 0.0 < figures["tip_rms_error_mm"] < 100.0

    path = Path(figures["log"])
    assert path.is_relative_to(tmp_path / "state")
    assert path.stat().st_size == figures["log_bytes"]
    summary = summarise(LogReader(path))
    assert summary.finished
    assert summary.ticks == figures["ticks"]
    rerun = Path(sys.executable).with_name("rerun")
    checked = subprocess.run(
        [rerun, "mcap", "check", path], capture_output=True, text=True, timeout=60
    )
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_demo_too_short_is_one_sentence() -> None:
    done = run_command("demo", "--seconds", "0.2")
    assert done.returncode == 1
    assert done.stderr == "pneuarm: --seconds 0.2: at least 1 is needed\n"


def test_table_tells_how_to_see_it_again() -> None:
    latency = {"p50": 1.0, "p99": 2.0, "max": 3.0}
    figures = demo.Figures(1000, 999.5, 2, latency, latency, 0, 4.25, "/logs/a.mcap", 2_500_000)
    text = demo.table(figures)
    for words in ("999.50 Hz, 2 overruns", "4.25 mm", "2.5 MB", "/logs/a.mcap"):
        assert words in text
    lines = text.splitlines()
    assert lines[-2].endswith("pneuarm replay /logs/a.mcap")
    assert lines[-1].endswith("rerun /logs/a.mcap")


@pytest.mark.parametrize("seconds", ["nan", "-1"])
def test_demo_refuses_what_is_no_time(seconds: str) -> None:
    done = run_command("demo", f"--seconds={seconds}")
    assert done.returncode == 1
    assert "at least 1 is needed" in done.stderr
