"""What may be typed as the value of an argument, and the parser that says so in one sentence."""

import argparse
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

from pneuarm.controllers.arm.errors import PneuarmError

#: Where a count has no bound of its own: what fits 64 bits.
_MOST = 2**63 - 1


def number(
    low: float = -math.inf, high: float = math.inf, *, above: bool = False
) -> Callable[[str], float]:
    """Return the type of a finite number from ``low`` to ``high``, ``above``: without ``low``."""

    def read(text: str) -> float:
        value: float = _read(float, text)
        if not math.isfinite(value) or not low <= value <= high or (above and value == low):
            raise argparse.ArgumentTypeError(f"{text!r}: {needed} is needed")
        return value

    needed = "a finite number"
    if low > -math.inf:
        needed += f" {'above' if above else 'from'} {low:g}"
    if high < math.inf:
        needed += f" up to {high:g}"
    return read


def whole(low: int = -_MOST, high: int = _MOST) -> Callable[[str], int]:
    """Return the type of a whole number from ``low`` to ``high``."""

    def read(text: str) -> int:
        value: int = _read(int, text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(
                f"{text!r}: a whole number from {low} to {high} is needed"
            )
        return value

    return read


def path(text: str) -> Path:
    """Read the path of a file or a folder."""
    if not text or "\0" in text:
        raise argparse.ArgumentTypeError(f"{text!r}: the path of a file or a folder is needed")
    return Path(text)


def _read(kind: Callable[[str], Any], text: str) -> Any:
    try:
        return kind(text)
    except ValueError:  # of thousands of digits too
        what = "a whole number" if kind is int else "a number"
        raise argparse.ArgumentTypeError(f"{text!r}: {what} is needed") from None


class _Numbers:
    """Tells negative numbers from options; argparse itself takes -1e1 and -inf for options.

    What begins as a number was meant for one: -1,5 and -20mm are refused as numbers, by their text.
    """

    def match(self, text: str) -> bool:
        if re.match(r"-\.?\d", text):
            return True
        try:
            float(text)
        except ValueError:
            return False
        return True


class Parser(argparse.ArgumentParser):
    """Says in one sentence what is wrong; numbers are finite and paths are paths, unless told."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._negative_number_matcher: Any = _Numbers()
        self.register("type", float, number())
        self.register("type", int, whole())
        self.register("type", Path, path)

    def error(self, message: str) -> NoReturn:
        """Raise UsageError."""
        raise UsageError(f"{message}; see: {self.prog} --help")


class UsageError(PneuarmError):
    """What was typed is no command; the text is one sentence."""
