"""The fault campaign itself: it finds what is broken, says how to see it again, and runs."""

import json
import random
from pathlib import Path

import numpy as np
import pytest

from tools.faults import client_faults, process_faults
from tools.faults.campaign import run_campaign
from tools.faults.device_audit import audit_device
from tools.faults.fault import Fault, Row
from tools.faults.fuzz import Garbage
from tools.faults.injection import Injection
from tools.faults.report import BEGIN, END, Report, write_again, write_page
from tools.rig.arms import paper_arm


@pytest.mark.slow
def test_two_injections_of_two_faults_keep_every_invariant() -> None:
    names = ("client frozen", "recorder killed")
    faults = [f for f in (*client_faults.FAULTS, *process_faults.FAULTS) if f.name in names]
    rows = list(run_campaign(faults, times=1, seed=0))
    report = Report(0, rows)
    assert [len(row.injections) for row in rows] == [1, 1]
    assert report.broken == []
    assert min(injection.kept for row in rows for injection in row.injections) >= 10
    assert any(row.times_s for row in rows)


def injection_at(seed: int, begin_ns: int, end_ns: int) -> Injection:
    injection = Injection("x", seed, random.Random(seed), begin_ns=begin_ns, end_ns=end_ns)
    injection.zero_within_s = 0.3
    return injection


def record(path: Path, *entries: tuple[float, float], why: str = "write") -> Path:
    """Write setpoints (time s, pressure Pa of all chambers), then an empty arm."""
    lines = [{"time_s": t, "why": why, "setpoints_pa": [p] * 3} for t, p in entries]
    last_s = entries[-1][0]
    empty = {"time_s": last_s + 0.2, "measured_pa": [0.0] * 3, "true_pa": [0.0] * 3}
    path.write_text("\n".join(json.dumps(line) for line in [*lines, empty]) + '\n{"time')
    return path


def test_a_device_that_is_zeroed_in_time_is_well(tmp_path: Path) -> None:
    injection = injection_at(0, 2_000_000_000, 4_000_000_000)
    path = record(tmp_path / "r", (1.0, 0.0), (1.1, 1e4), (1.5, 5e4), (2.25, 0.0))
    audit_device(path, paper_arm(), [injection])
    assert injection.broken == []
    assert injection.safe_s == pytest.approx(0.25)
    assert injection.empty_s == pytest.approx(0.45)


@pytest.mark.parametrize(
    ("entries", "broken"),
    [
        (((1.0, 0.0), (1.1, 9.5e4), (2.1, 0.0)), "setpoints inside their limits"),
        (((1.0, 0.0), (1.1, 5e4), (2.1, 0.0)), "slew at the device"),
        (((1.0, 0.0), (1.6, 5e4), (2.4, 0.0)), "zero in time"),
        (((1.0, 0.0), (1.6, 5e4)), "the device is zeroed"),
    ],
)
def test_what_must_not_reach_a_device_is_found(
    tmp_path: Path, entries: tuple[tuple[float, float], ...], broken: str
) -> None:
    injection = injection_at(0, 2_000_000_000, 4_000_000_000)
    audit_device(record(tmp_path / "r", *entries), paper_arm(), [injection])
    assert any(line.startswith(broken) for line in injection.broken)


def row_of(seed: int, *broken: str) -> Row:
    injection = Injection("it breaks", seed, random.Random(seed), kept=3, broken=list(broken))
    injection.safe_s = 0.1 * (seed + 1)
    return Row(Fault("it breaks", "goes on", lambda rig, injection: None), [injection])


def test_what_is_broken_is_told_with_its_seed_and_goes_into_the_page(tmp_path: Path) -> None:
    report = Report(0, [row_of(0), row_of(7, "slew: 3 steps")])
    assert len(report.broken) == 1
    assert "--only 'it breaks' --times 1 --seed 7" in report.broken[0]
    assert "| it breaks | goes on | 1 | 3 of 4 | 800 ms | 800 ms |  |  |" in report.table()
    page = tmp_path / "page.md"
    page.write_text(f"above\n{BEGIN}old{END}\nbelow\n")
    write_page(page, report.markdown())
    text = page.read_text()
    assert text.startswith("above\n")
    assert text.endswith("below\n")
    assert "old" not in text
    page.write_text("no comments")
    with pytest.raises(ValueError, match="lacks the comments"):
        write_page(page, "")


def test_a_fault_that_is_run_again_takes_its_row_and_leaves_the_others(tmp_path: Path) -> None:
    def row(name: str, kept: int, broken: list[str]) -> Row:
        injection = Injection(name, 0, random.Random(0), kept=kept, broken=broken)
        return Row(Fault(name, "holds", lambda rig, injection: None), [injection])

    page = tmp_path / "page.md"
    page.write_text(f"above\n{BEGIN}\n{END}\nbelow\n")
    first = Report(0, [row("one", 5, []), row("two", 4, ["the slew"])])
    write_page(page, first.markdown())
    assert "- two, seed 0: the slew" in page.read_text()
    write_again(page, Report(0, [row("two", 5, [])], valves="itv"))
    text = page.read_text()
    assert "| one | holds | 1 | 5 of 5 |" in text
    assert "| two | holds | 1 | 5 of 5 |" in text
    assert "- two, seed" not in text
    (again,) = (line for line in text.splitlines() if line.startswith("Again: two: 1 "))
    assert all(fact in again for fact in ("itv", "seed 0", "0 invariants broken"))


def test_a_fault_that_cannot_be_injected_says_why() -> None:
    fault = Fault("never", "goes on", lambda rig, injection: None, unable=lambda: "needs rights")
    (row,) = run_campaign([fault], times=3, seed=0)
    assert row.injections == []
    assert "| never | goes on | 0 | needs rights |" in Report(0, [row]).table()
    assert "unfinished: 1 of 3 faults" in Report(0, [row], faults=3).markdown()
    assert "unfinished" not in Report(0, [row], faults=1).markdown()


def test_garbage_is_the_same_for_a_seed_and_of_every_kind() -> None:
    one, same, other = ([Garbage(s).payload() for s in seeds] for seeds in ([5], [5], [6]))
    assert one == same != other
    garbage = Garbage(1)
    payloads = [garbage.payload() for _ in range(500)]
    assert np.unique([encoding for _, encoding in payloads]).size > 5
    assert max(len(payload) for payload, _ in payloads) > 65536 - 1
