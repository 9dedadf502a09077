"""Every small mistake in the guard is found by its checks: no mutant survives."""

import inspect

import numpy as np

from pneuarm.hardware import guard
from tests.hardware.guard_checks import CHECKS
from tests.hardware.mutants import load, mutants

#: Mutants that do the same as the guard, and why.
EQUIVALENT: dict[str, str] = {
    "Guard.check: if (supplied == pressures_pa).all(): ... -> pass": "only saves time: where no "
    "stage changed anything, _why finds nothing either",
    "Guard.check: return Guarded(supplied, Intervention.NOTHING) -> pass": "the same",
    "Guard._supplied: if self._flow_max_pa_s == inf: ... -> pass": "only saves time: no sum is "
    "above an infinite one",
    "Guard._supplied: return wanted -> pass": "the same, for the first of the two",
    "Guard._supplied: float(rises.sum()) -> rises.sum()": "a numpy number in place of Python's",
    "Guard._supplied: needed > largest -> needed >= largest": "where both are equal the factor is "
    "one, and nothing is shortened",
}


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
