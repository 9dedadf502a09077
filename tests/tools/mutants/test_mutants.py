"""Mutants are small, different and told apart; the tests run on them and not on the file."""

import subprocess
import sys

import pytest

from tools.mutants.changes import mutants
from tools.mutants.modules import ROOT, equivalent, modules
from tools.mutants.report import Verdict, written

SOURCE = '''
"""A module."""

LIMIT_PA = 150.0


def clipped(value: float) -> float:
    """Return it within the limit."""
    if value > LIMIT_PA:
        return LIMIT_PA
    if value > LIMIT_PA:
        raise ValueError(f"{value * 2} is too much")
    return value
'''

PAGE = "before\n<!-- mutants -->\n<!-- /mutants -->\nafter\n"

#: Whether the tests of a module fail on it as it is, and where it is nothing but a comment.
TRY_BOTH = """
from tools.mutants.running import Limits, load_libraries, run
import tempfile
with tempfile.TemporaryDirectory() as scratch:
    load_libraries(scratch)
    path = "service/safety/faults.py"
    for text in (open(path).read(), "# nothing"):
        tests = ["tests/service/safety/test_faults.py"]
        print(int(run("pneuarm.service.safety.faults", text, tests, Limits()).status != 0))
"""


def test_every_mutant_is_another_program_with_a_name_of_its_own() -> None:
    made = list(mutants(SOURCE))
    names, texts = zip(*made, strict=True)
    assert len(set(names)) == len(set(texts)) == len(made)
    for text in texts:
        compile(text, "<mutant>", "exec")
    assert "LIMIT_PA = 150.0 -> pass" in names
    assert "150.0 -> 300.0" in names
    assert "clipped: value > LIMIT_PA -> value >= LIMIT_PA" in names
    assert "clipped: value > LIMIT_PA -> value >= LIMIT_PA (2)" in names
    assert not any("value * 2 ->" in name or "A module" in name for name in names)


def test_every_module_and_every_test_of_it_is_there() -> None:
    for module, tests in modules().items():
        assert (ROOT / module).is_file()
        assert tests
        assert all((ROOT / test).exists() for test in tests)


@pytest.mark.parametrize("module", [name for name, known in equivalent().items() if known])
def test_what_is_named_equivalent_is_made_and_has_a_reason(module: str) -> None:
    known = equivalent()[module]
    assert known.keys() <= dict(mutants((ROOT / module).read_text())).keys()
    assert all(known.values())


def test_a_table_keeps_the_rows_of_modules_that_were_not_tried_again() -> None:
    first = Verdict("a.py", 9, ("same", "missed"), {"same": "it is", "gone": "no more"})
    assert (first.unnoticed, first.stale) == (("missed",), ("gone",))
    page = written(PAGE, [first], ["a.py", "b.py"])
    page = written(page, [Verdict("b.py", 5, (), {})], ["a.py", "b.py"])
    page = written(page, [Verdict("a.py", 8, ("same",), {"same": "it is"})], ["a.py", "b.py"])
    rows = [line for line in page.splitlines() if line.startswith("| `")]
    assert rows == ["| `a.py` | 8 | 7 | 1 | 0 |", "| `b.py` | 5 | 5 | 0 | 0 |"]
    assert page.startswith("before\n")
    assert page.endswith("after\n")


def test_a_page_without_a_place_for_the_table_is_refused() -> None:
    with pytest.raises(ValueError, match="<!-- mutants -->"):
        written("nothing here", [], [])


def test_the_tests_see_the_text_and_not_the_file() -> None:
    told = subprocess.run(
        [sys.executable, "-c", TRY_BOTH], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert told.stdout.split() == ["0", "1"]
