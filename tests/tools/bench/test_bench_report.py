"""`make bench` finds every benchmark that it runs, and writes what it was not told."""

from importlib import import_module

import pytest

from tools.bench.report import BENCHMARKS, ROWS, page


@pytest.mark.parametrize("name", BENCHMARKS)
def test_every_benchmark_is_a_module_that_runs(name: str) -> None:
    assert callable(import_module(f"tools.bench.{name}").main)


def test_a_figure_that_was_never_measured_has_its_row_all_the_same() -> None:
    rows = [line for line in page({}).splitlines() if line.startswith("| ")]
    assert len(rows) == len(ROWS) + 1
    assert all("not measured" in row for row in rows[1:])
