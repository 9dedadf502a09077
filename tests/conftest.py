"""How the tests are shared between two workers, and which are done again.

Tests that run real processes, daemons above all, go one after another on one worker: two real-time
loops on two cores would make each other late. Everything else goes on beside them. Where the
machine makes such a daemon late all the same, the test is done again: tools.rig.interruptions.
"""

import os
import signal
import subprocess
from collections.abc import Iterator
from types import ModuleType

import pytest

from tools.rig.interruptions import DoneAgain

_REAL = ("tools.rig.daemon", "tools.rig.wire", "tools.rig.emulators", "tools.faults")


def pytest_configure(config: pytest.Config) -> None:
    """Let tests be done again in which the machine made an arm hold; give Ctrl-C its meaning back.

    A shell's background job ignores it, and so would every program that a test starts.
    """
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    config.pluginmanager.register(DoneAgain())


@pytest.fixture(autouse=True)
def ordinary_priority() -> Iterator[None]:
    """Give back the real-time priority that a command took in the process of the test."""
    yield
    if os.sched_getscheduler(0) != os.SCHED_OTHER:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


@pytest.hookimpl(tryfirst=True)  # before xdist looks at the groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the tests of modules that start processes into one group."""
    for item in items:
        module = getattr(item, "module", None)
        if isinstance(module, ModuleType) and _starts_processes(module):
            item.add_marker(pytest.mark.xdist_group("processes"))


def _starts_processes(module: ModuleType) -> bool:
    return any(
        value is subprocess or str(getattr(value, "__module__", "")).startswith(_REAL)
        for value in vars(module).values()
    )
