"""How the tests are shared between two workers.

Tests that run real processes, daemons above all, go one after another on one worker: two real-time
loops on two cores would make each other late. Everything else goes on beside them.
"""

import subprocess
from types import ModuleType

import pytest

_REAL = ("tools.rig.daemon", "tools.rig.wire", "tools.rig.emulators", "tools.faults")


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
