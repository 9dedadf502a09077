"""Every small mistake in the guard is found by its checks: no mutant survives."""

import inspect
import sys
from types import ModuleType

import numpy as np

from pneuarm.hardware import guard
from tests.hardware.guard_checks import CHECKS
from tools.mutants.changes import mutants
from tools.mutants.modules import equivalent

#: Mutants that do the same as the guard.
EQUIVALENT = equivalent()["hardware/guard.py"]


def load(source: str) -> ModuleType:
    """Run a mutant's source as a module of its own."""
    module = ModuleType("mutant")
    sys.modules["mutant"] = module  # dataclasses look their module up
    exec(compile(source, "<mutant>", "exec"), module.__dict__)
    return module


def killer(source: str) -> str:
    """Name of the first check that a mutant fails, or an empty string."""
    try:
        mutant = load(source).Guard
    except Exception:
        return "loading"
    for check in CHECKS:
        try:
            with np.errstate(all="ignore"):
                check(mutant)
        except BaseException as error:  # pytest's own failures are no Exception
            if isinstance(error, KeyboardInterrupt):
                raise
            return check.__name__
    return ""


def test_no_mutant_of_the_guard_survives() -> None:
    source = inspect.getsource(guard)
    assert killer(source) == ""
    survivors = {name for name, mutant in mutants(source) if not killer(mutant)}
    assert survivors - set(EQUIVALENT) == set(), "the guard's checks do not see these mistakes"
    assert set(EQUIVALENT) - survivors == set(), "these are not equivalent, or exist no more"
