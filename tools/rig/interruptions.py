"""A test in which a busy machine made the arm hold is done again, from the start of its daemon.

A daemon whose processes are not given their time tells so and stops the arm, as it should. What a
test wanted to see then did not happen, and that proves nothing. It is done again when, and only
when, a daemon itself told of this during the test, and the test had not broken the very part that
the daemon tells of: a fault of any other kind, or a cause of the test's own, fails it at once.
"""

import contextlib
import time
from collections.abc import Iterator

import pytest
from _pytest.runner import runtestprotocol

from pneuarm.controllers.arm.errors import LogError
from tools.rig.daemon import Daemon

#: How often a test is done at most; where it fails each time, it has failed.
TIMES = 4

#: Codes of events that tell of a process that came too late, and the parts of which any, broken by
#: the test, explains the event too.
INTERRUPTIONS: dict[str, frozenset[str]] = {
    "gateway_silent": frozenset({"gateway"}),
    "gateway_lost": frozenset({"gateway"}),
    "target_stale": frozenset({"client", "gateway"}),
    "measurement_old": frozenset({"device", "control"}),
    "device_lost": frozenset({"device", "control"}),
    "loop_overruns": frozenset({"device", "control"}),
    "control_lost": frozenset({"control"}),
}

#: Name of the property of a report that says why its test was done again.
PROPERTY = "done again"


def interruptions(since_ns: int) -> list[str]:
    """Return the codes by which daemons have told, since a time (UTC), that they came too late."""
    return [code for daemon in Daemon.launched for code in _told(daemon, since_ns)]


def _told(daemon: Daemon, since_ns: int) -> Iterator[str]:
    if daemon.lost_control(since_ns):  # also where it ended before there was a log
        yield "control_lost"
    with contextlib.suppress(ValueError, LogError):  # no session: it has not come so far
        if daemon.log().parts[-1].stat().st_mtime_ns < since_ns:
            return
        for event in daemon.events():
            parts = INTERRUPTIONS.get(event.code, frozenset())
            broken = any(daemon.broke(part, event.time_unix_ns) for part in parts)
            if parts and not broken and event.time_unix_ns >= since_ns:
                yield event.code


class DoneAgain:
    """The plugin that does it for every test that starts a daemon."""

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item, nextitem: pytest.Item | None) -> bool:
        """Do a test, as often as it takes to see it whole; only the last time is reported."""
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        for left in reversed(range(TIMES)):
            begun_ns = time.time_ns()
            for daemon in Daemon.launched:
                daemon.forget_what_was_broken()
            reports = runtestprotocol(item, nextitem=nextitem, log=False)
            if not any(report.failed for report in reports):
                break
            _leave_the_room(item)
            told = interruptions(begun_ns)
            if not told or not left:
                break
            item.user_properties.append((PROPERTY, ", ".join(sorted(set(told)))))
        for report in reports:
            item.ihook.pytest_runtest_logreport(report=report)
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        return True

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Say which tests were done again, and what their daemons had told."""
        for reports in terminalreporter.stats.values():
            for report in reports:
                why = [v for n, v in getattr(report, "user_properties", []) if n == PROPERTY]
                if why and report.when == "teardown":
                    terminalreporter.write_line(f"done again: {report.nodeid} ({'; '.join(why)})")


def _leave_the_room(item: pytest.Item) -> None:
    """End the daemon that the tests of a module share: its log is whole then, the next one new."""
    module = item.getparent(pytest.Module)
    above = None if module is None else module.parent
    with contextlib.suppress(Exception, pytest.fail.Exception):  # the test has failed already
        item.ihook.pytest_runtest_teardown(item=item, nextitem=above)
