"""What became of the mutants, and its table in a page."""

import re
from dataclasses import dataclass
from pathlib import Path

from tools.docs.regions import table

_PLACE = re.compile(r"(<!-- mutants -->\n).*?(<!-- /mutants -->)", re.S)
_HEADING = ("module", "made", "killed", "equivalent", "not noticed")


@dataclass(frozen=True)
class Verdict:
    """The mutants of one module: how many were made, and which no test has noticed."""

    module: str
    made: int
    survivors: tuple[str, ...]
    equivalent: dict[str, str]

    @property
    def unnoticed(self) -> tuple[str, ...]:
        """Survivors that are not named equivalent: mistakes that the tests would not see."""
        return tuple(name for name in self.survivors if name not in self.equivalent)

    @property
    def stale(self) -> tuple[str, ...]:
        """Mutants that are named equivalent, and were killed or exist no more."""
        return tuple(name for name in self.equivalent if name not in self.survivors)

    def row(self) -> tuple[str, ...]:
        """The line of the table."""
        killed = self.made - len(self.survivors)
        same = len(self.survivors) - len(self.unnoticed)
        numbers = (self.made, killed, same, len(self.unnoticed))
        return f"`{self.module}`", *map(str, numbers)


def written(page: str, verdicts: list[Verdict], modules: list[str]) -> str:
    """Return a page with the rows of ``verdicts`` made anew; rows of other modules stay."""
    found = _PLACE.search(page)
    if found is None:
        raise ValueError("the page has no place for the table: <!-- mutants --> <!-- /mutants -->")
    rows = dict(_rows(found[0])) | {f"`{v.module}`": v.row() for v in verdicts}
    order = [f"`{name}`" for name in modules if f"`{name}`" in rows]
    text = table(_HEADING, [rows[name] for name in order])
    return _PLACE.sub(lambda place: f"{place[1]}\n{text}\n\n{place[2]}", page)


def _rows(region: str) -> list[tuple[str, tuple[str, ...]]]:
    lines = [line for line in region.splitlines() if line.startswith("| `")]
    cells = [tuple(cell.strip() for cell in line.strip("|").split("|")) for line in lines]
    return [(row[0], row) for row in cells]


def write(page: Path, verdicts: list[Verdict], modules: list[str]) -> None:
    """Write the rows into the page's table."""
    page.write_text(written(page.read_text(), verdicts, modules))
