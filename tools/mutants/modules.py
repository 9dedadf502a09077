"""Which modules are mutated, which tests must notice it, and which mutants nobody can notice."""

import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

_LIMITS = "tests/controllers/limits"
_MONITORS = "tests/service/monitors/test_monitors.py"
_CHECKS = ("tests/service/wire/test_checks.py", "tests/service/wire/test_shape_checks.py")
_SAFETY = "tests/service/safety"

#: Tests of every module or folder, quick ones first: the first that fails ends a mutant. None of
#: them starts a process, for that would load the module as it stands in its file.
TESTS: dict[str, tuple[str, ...]] = {
    "hardware/guard.py": ("tests/hardware/test_guard.py",),
    "hardware/guarded.py": (
        "tests/hardware/test_guarded_shortfall.py",
        "tests/hardware/test_guarded.py",
    ),
    "service/wire/lease.py": ("tests/service/wire/test_lease.py",),
    "service/modes": ("tests/service/modes",),
    "controllers/laws/safe_step.py": (
        "tests/controllers/laws/test_safe_step_walls.py",
        "tests/controllers/laws/test_safe_step.py",
    ),
    "service/devices/process.py": ("tests/service/devices/test_process.py",),
    "service/safety": (
        f"{_SAFETY}/test_faults.py",
        f"{_SAFETY}/test_ramp.py",
        f"{_SAFETY}/test_fault_keeper.py",
        f"{_SAFETY}/test_safety.py",
    ),
    "service/monitors": (_MONITORS,),
    "service/wire/target_checks.py": _CHECKS,
    "controllers/targets/checks.py": _CHECKS,
    "controllers/limits": (_LIMITS, "tests/controllers/laws/test_safe_step_walls.py"),
}


def modules() -> dict[str, tuple[str, ...]]:
    """Return every file that is mutated, from the root of the checkout, and its tests."""
    return {
        path.relative_to(ROOT).as_posix(): tests
        for place, tests in TESTS.items()
        for path in (sorted((ROOT / place).glob("*.py")) or [ROOT / place])
        if path.name != "__init__.py"
    }


def equivalent() -> dict[str, dict[str, str]]:
    """Return the mutants of every file that do the same as the code, each with the reason."""
    read = tomllib.loads(Path(__file__).with_name("equivalent.toml").read_text())
    return {path: dict(read.get(path, {})) for path in modules()}
