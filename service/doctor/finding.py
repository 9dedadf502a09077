"""What a check has found, and the line that says it."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum

_WIDTH = 100
_INDENT = 29


class Verdict(StrEnum):
    """How it is: ``info`` is for what cannot be known here, or needs no judgement."""

    OK = "ok"
    INFO = "info"
    WARNING = "warning"
    FAILED = "failed"


@dataclass(frozen=True)
class Finding:
    """One check: what was found, a remedy that can be pasted where one helps, and its figures."""

    check: str
    verdict: Verdict
    text: str
    remedy: str = ""
    values: dict[str, float] = field(default_factory=dict)

    def lines(self) -> list[str]:
        """Return the finding for a terminal; a remedy is never broken, so that it can be copied."""
        text = [
            part
            for line in self.text.splitlines()
            for part in textwrap.wrap(line, _WIDTH - _INDENT, break_on_hyphens=False)
        ]
        first = f"{self.verdict:8} {self.check:20}{text[0]}"
        rest = [" " * _INDENT + line for line in text[1:]]
        remedy = [" " * _INDENT + f"-> {line}" for line in self.remedy.splitlines()]
        return [first, *rest, *remedy]


def summary(findings: Sequence[Finding]) -> str:
    """Say in one line whether the PC is ready."""
    failed = sum(finding.verdict is Verdict.FAILED for finding in findings)
    warnings = sum(finding.verdict is Verdict.WARNING for finding in findings)
    told = f"{warnings} warning{'s' * (warnings != 1)}"
    if failed:
        return f"not ready: {failed} failed, {told}"
    return "ready" if not warnings else f"ready, with {told}"
