"""What each process uses, from /proc; the time is an argument."""

import multiprocessing
import os
import subprocess
import sys

import pytest

from pneuarm.service.processes.usage import NAMES, ProcessTable, ProcessUsage

CONTEXT = multiprocessing.get_context("spawn")


def table(**pids: int) -> ProcessTable:
    made = ProcessTable.create(CONTEXT)
    for name, pid in pids.items():
        made.started(name, pid)
    return made


def burn(seconds: float) -> None:
    """Use the processor for some time of its own."""
    end = sum(os.times()[:2]) + seconds
    while sum(os.times()[:2]) < end:
        sum(range(1000))


def test_an_empty_table_has_no_rows() -> None:
    assert table().rows() == []
    assert ProcessUsage(table()).read(0.0, {}) == []


def test_processes_are_listed_in_their_order_with_restarts() -> None:
    made = table(recorder=12, control=11)
    made.started("recorder", 13, restarts=2)
    assert made.rows() == [("control", 11, 0), ("recorder", 13, 2)]
    assert [name for name, _, _ in table(**dict.fromkeys(NAMES, 1)).rows()] == list(NAMES)


def test_only_processes_of_the_daemon_have_a_place() -> None:
    with pytest.raises(ValueError, match="not in"):
        table(browser=1)


def test_the_share_of_a_core_since_the_last_reading() -> None:
    usage = ProcessUsage(table(control=os.getpid()))
    (first,) = usage.read(100.0, {})
    assert (first.name, first.pid, first.cpu_share) == ("control", os.getpid(), 0.0)
    burn(0.1)
    (second,) = usage.read(101.0, {})
    assert second.cpu_share > 0.08
    burn(0.1)
    (third,) = usage.read(201.0, {})  # as much, over a hundred times the time
    assert 0.0008 < third.cpu_share < second.cpu_share / 10
    assert usage.read(201.0, {})[0].cpu_share == 0.0


def test_memory_is_what_is_resident() -> None:
    usage = ProcessUsage(table(control=os.getpid()))
    before = usage.read(0.0, {})[0].memory_bytes
    ballast = bytearray(os.urandom(1)) * 50_000_000
    after = usage.read(1.0, {})[0].memory_bytes
    assert after - before > 40_000_000
    assert len(ballast) == 50_000_000


def test_drops_and_restarts_are_passed_on() -> None:
    made = table()
    made.started("viewer", os.getpid(), restarts=4)
    (row,) = ProcessUsage(made).read(0.0, {"viewer": 7, "recorder": 8})
    assert (row.dropped, row.restarts) == (7, 4)
    made.started("gateway", os.getpid())
    rows = ProcessUsage(made).read(0.0, {"viewer": 7})
    assert {row.name: row.dropped for row in rows} == {"viewer": 7, "gateway": 0}


def test_a_process_that_is_gone_is_left_out() -> None:
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    usage = ProcessUsage(table(control=os.getpid(), recorder=child.pid))
    assert [row.name for row in usage.read(0.0, {})] == ["control", "recorder"]
    child.communicate()
    assert [row.name for row in usage.read(1.0, {})] == ["control"]


STRANGELY_NAMED = """
import ctypes, os
ctypes.CDLL(None).prctl(15, b"a) b (c", 0, 0, 0)
for line in os.fdopen(0):
    end = sum(os.times()[:2]) + 0.2
    while sum(os.times()[:2]) < end:
        pass
    print(flush=True)
"""


def test_a_name_with_spaces_and_brackets_does_not_confuse_it() -> None:
    child = subprocess.Popen(
        [sys.executable, "-c", STRANGELY_NAMED], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert child.stdin is not None
    assert child.stdout is not None
    usage = ProcessUsage(table(control=child.pid))
    for now_s in (0.0, 1.0):
        child.stdin.write(b"work\n")
        child.stdin.flush()
        child.stdout.readline()
        (row,) = usage.read(now_s, {})
    assert row.cpu_share > 0.15
    child.communicate()
