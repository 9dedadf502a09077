"""The pages, and what makes each kind of table in them."""

from collections.abc import Callable
from pathlib import Path

from tools.docs import configuration, messages, tables
from tools.docs.regions import NoSuchTable, filled

ROOT = Path(__file__).resolve().parents[2]
PAGES = tuple(sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]))

#: What makes a table, by the first word of its name.
MAKERS: dict[str, Callable[[str], str]] = {
    "configuration": configuration.make,
    "presets": tables.make_presets,
    "keys": messages.make_topics,
    "enums": messages.make_enums,
    "message": messages.make_message,
    "codes": messages.make_codes,
    "modes": tables.make_modes,
    "faults": tables.make_faults,
    "monitors": tables.make_monitors,
    "exceptions": tables.make_exceptions,
    "rooms": tables.make_rooms,
    "simulator": tables.make_simulator,
    "valves": tables.make_valves,
}


def make(name: str) -> str:
    """Return a table by its name; raises NoSuchTable where nothing makes it."""
    maker = MAKERS.get(name.split()[0])
    if maker is None:
        raise NoSuchTable(f"nothing makes {name!r}; there are {', '.join(MAKERS)}")
    return maker(name)


def fresh(page: str) -> str:
    """Return a page with all of its tables made anew."""
    return filled(page, make)
