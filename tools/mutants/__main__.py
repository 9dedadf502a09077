"""Make every small mistake in the modules that safety rests on, and see that a test notices it.

    python -m tools.mutants [MODULE ...] [--write PAGE]

One process at a time. A mutant that no test notices, and that equivalent.toml does not explain, is
told, and the exit status is 1.
"""

import argparse
import ast
import sys
import tempfile
import time
from pathlib import Path

from tools.mutants.changes import mutants
from tools.mutants.modules import ROOT, equivalent, modules
from tools.mutants.report import Verdict, write
from tools.mutants.running import Limits, load_libraries, run


def main() -> int:
    """Try the modules that were named, else all of them."""
    options = _options()
    every, explained = modules(), equivalent()
    failed = False
    with tempfile.TemporaryDirectory() as scratch:
        load_libraries(scratch)
        for module in options.modules or every:
            verdict = _try(module, every[module], explained[module])
            failed |= bool(verdict.unnoticed or verdict.stale)
            if options.write:
                write(options.write, [verdict], list(every))
    return int(failed)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tools.mutants", description=__doc__)
    parser.add_argument("modules", nargs="*", metavar="MODULE", help="such as hardware/guard.py")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="put the table into this page")
    options = parser.parse_args()
    unknown = [name for name in options.modules if name not in modules()]
    if unknown:
        parser.error(f"{', '.join(unknown)}: not mutated; there are {', '.join(modules())}")
    if options.write and not options.write.is_file():
        parser.error(f"{options.write}: no such page")
    return options


def _try(module: str, tests: tuple[str, ...], explained: dict[str, str]) -> Verdict:
    """Run the tests of a module on each of its mutants; tell what was not noticed."""
    begun_s = time.monotonic()
    source = (ROOT / module).read_text()
    name = "pneuarm." + module.removesuffix(".py").replace("/", ".")
    itself = run(name, ast.unparse(ast.parse(source)), tests, Limits())
    if itself.status:
        sys.exit(f"{module}: the tests fail on the code as it is: {' '.join(tests)}")
    limits = Limits.of(itself.cpu_s, itself.wall_s)
    every = dict(mutants(source))
    survivors = [key for key, text in every.items() if not run(name, text, tests, limits).status]
    verdict = Verdict(module, len(every), tuple(survivors), explained)
    print(" ".join(verdict.row()), f"in {time.monotonic() - begun_s:.0f} s", flush=True)
    for key in verdict.unnoticed:
        print(f"  not noticed: {key}", flush=True)
    for key in verdict.stale:
        print(f"  not equivalent, or exists no more: {key}", flush=True)
    return verdict


if __name__ == "__main__":
    sys.exit(main())
