"""One mutant, one forked process: the tests run on it in an interpreter that is warm already.

The libraries are loaded before the fork, our own code after it, with the mutant in the place of its
file. Nothing is written into the checkout.
"""

import importlib
import os
import resource
import signal
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from types import CodeType, ModuleType
from typing import Any

#: What takes long to load, and is none of our code.
_LIBRARIES = (
    "numpy",
    "casadi",
    "hypothesis.strategies",
    "osqp",
    "pydantic",
    "pytest",
    "ruckig",
    "scipy.interpolate",
    "scipy.optimize",
    "scipy.spatial.transform",
)

#: Hypothesis' profile for mutants: that a test fails is all that is asked, not its least example,
#: which takes a hundred times as long to find.
_PROFILE = "mutants"

#: A mutant may need this much more processor time than the tests need on the code itself; one that
#: sleeps without end is ended by the clock, far later, so that a busy machine kills none.
_CPU_FACTOR, _CPU_MORE_S = 4.0, 10.0
_WALL_FACTOR, _WALL_MORE_S = 10.0, 60.0

_POLL_S = 0.01


def load_libraries(scratch: str) -> None:
    """Load what every mutant's tests need; Hypothesis keeps its examples in ``scratch``."""
    for name in _LIBRARIES:
        importlib.import_module(name)
    importlib.import_module("hypothesis.configuration").set_hypothesis_home_dir(scratch)
    hypothesis = importlib.import_module("hypothesis")
    phases = [phase for phase in hypothesis.Phase if phase.name not in ("shrink", "explain")]
    hypothesis.settings.register_profile(_PROFILE, deadline=None, phases=phases)


class _Loader(SourceFileLoader):
    """Loads a module from a text instead of its file."""

    def __init__(self, name: str, path: str, text: str) -> None:
        super().__init__(name, path)
        self._text = text

    def get_code(self, fullname: str) -> CodeType:
        return compile(self._text, self.path, "exec")


class _Finder(MetaPathFinder):
    """Puts a text in the place of one module."""

    def __init__(self, name: str, text: str) -> None:
        self._name, self._text = name, text

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname != self._name:
            return None
        spec = PathFinder.find_spec(fullname, path)
        if spec is not None and spec.origin is not None:
            spec.loader = _Loader(fullname, spec.origin, self._text)
        return spec


@dataclass(frozen=True)
class Limits:
    """How long a mutant may run, in seconds of its processor and of the clock."""

    cpu_s: float = 600.0
    wall_s: float = 1800.0

    @classmethod
    def of(cls, cpu_s: float, wall_s: float) -> "Limits":
        """What a mutant may take where the code itself takes so long."""
        return cls(
            _CPU_FACTOR * cpu_s + _CPU_MORE_S,
            _WALL_FACTOR * wall_s + _WALL_MORE_S,
        )


@dataclass(frozen=True)
class Run:
    """How the tests ended, 0 if all passed, and what they took in seconds."""

    status: int
    cpu_s: float
    wall_s: float


def run(name: str, text: str, tests: Sequence[str], limits: Limits) -> Run:
    """Run tests with a text in the place of the module ``name``."""
    begun_s = time.monotonic()
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        _in_child(name, text, tests, limits)
    status, usage = _wait(child, begun_s + limits.wall_s)
    return Run(status, usage.ru_utime + usage.ru_stime, time.monotonic() - begun_s)


def _in_child(name: str, text: str, tests: Sequence[str], limits: Limits) -> None:
    """Run the tests and end; the one way out of here is the exit."""
    status = 1
    try:
        os.setsid()
        silence = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(silence, stream)
        seconds = int(limits.cpu_s) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
        sys.meta_path.insert(0, _Finder(name, text))
        pytest = importlib.import_module("pytest")
        options = ["-x", "-q", "--tb=no", "-p", "no:cacheprovider"]
        options += ["--hypothesis-seed=0", f"--hypothesis-profile={_PROFILE}"]
        # Hypothesis was loaded before pytest could look at it, which its settings call an error.
        options += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]
        status = int(pytest.main([*options, "-m", "not slow", *tests]))
    finally:
        os._exit(status)


def _wait(child: int, until_s: float) -> tuple[int, Any]:
    while True:
        ended, status, usage = os.wait4(child, os.WNOHANG)
        if ended:
            return status, usage
        if time.monotonic() > until_s:
            os.killpg(child, signal.SIGKILL)
            _, status, usage = os.wait4(child, 0)
            return status, usage
        time.sleep(_POLL_S)
