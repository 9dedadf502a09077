"""The places in a page that are made: what stands between two comments is written from the code.

    <!-- made by make docs: faults -->
    ...
    <!-- end -->

Everything else on a page is written by hand, and left as it is.
"""

import re
from collections.abc import Callable, Sequence

_PLACE = re.compile(r"(<!-- made by make docs: ([^>]+?) -->\n).*?(<!-- end -->)", re.S)


class NoSuchTable(ValueError):
    """A page asks for something that the code does not make."""


def names(page: str) -> list[str]:
    """Names of what a page asks for, in its order."""
    return [name for _, name, _ in _PLACE.findall(page)]


def filled(page: str, make: Callable[[str], str]) -> str:
    """Return the page with every place made anew of its name."""
    return _PLACE.sub(lambda found: f"{found[1]}{_spaced(make(found[2]))}{found[3]}", page)


def _spaced(text: str) -> str:
    """Markdown wants an empty line between a comment and what follows."""
    return f"\n{text.strip()}\n\n"


def linked(text: str, page: str = "") -> str:
    """Return the text with links for pages, and for tables of the configuration on ``page``."""
    text = re.sub(r"docs/(\w+\.md)(#[\w-]+)?", r"[\1](\1\2)", text)
    return re.sub(r"`(\[+([a-z0-9_.]+)\]+)`", lambda m: f"[`{m[1]}`]({page}#{_anchor(m[2])})", text)


def _anchor(path: str) -> str:
    return path.replace(".", "")


def table(heading: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table of cells of text."""
    lines = [heading, ["---"] * len(heading), *rows]
    return "\n".join("|" + "|".join(_cell(cell) for cell in line) + "|" for line in lines)


def _cell(text: str) -> str:
    if text == "---":
        return text
    text = " ".join(text.split()).replace("|", "\\|")
    return f" {text} " if text else " "
