"""python -m tools.faults: the fault campaign."""

import argparse
import json
import sys
import time
from pathlib import Path

from pneuarm.hardware.simulator.parameters import NOMINAL
from tools.faults import (
    client_faults,
    device_faults,
    machine_faults,
    process_faults,
    sensor_faults,
    wire_faults,
)
from tools.faults.campaign import run_campaign, tell
from tools.faults.fault import Fault
from tools.faults.report import Report, write_again, write_page
from tools.faults.stop_latency import measure_stop

FAULTS: tuple[Fault, ...] = (
    *process_faults.FAULTS,
    *client_faults.FAULTS,
    *wire_faults.FAULTS,
    *machine_faults.FAULTS,
    *device_faults.FAULTS,
    *sensor_faults.FAULTS,
)


def main() -> int:
    """Run the campaign; 1 if an invariant was broken, 130 after Ctrl-C."""
    options = _parse()
    chosen = _chosen(options.only)
    report = Report(options.seed, faults=len(chosen), valves=options.valves)
    begin = time.monotonic()
    try:
        for row in run_campaign(chosen, options.times, options.seed, options.valves):
            report.rows.append(row)
            report.seconds = time.monotonic() - begin
            if options.write and not options.only:
                write_page(options.write, report.markdown())
        if not options.only or "stop" in options.only:
            tell("the stop's latency")
            report.stop = measure_stop(options.stops, options.valves)
    except KeyboardInterrupt:
        report.interrupted = True
        tell("\ninterrupted; this is what there is")
    report.seconds = time.monotonic() - begin
    if options.write and options.only:
        write_again(options.write, report)
    elif options.write:
        write_page(options.write, report.markdown())
    print(json.dumps(report.json(), indent=1) if options.json else report.markdown())
    for line in report.broken:
        tell(f"BROKEN  {line}")
    return 130 if report.interrupted else int(bool(report.broken))


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tools.faults", description=__doc__)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="faults whose name contains it")
    parser.add_argument("--times", type=int, default=30, help="injections of each fault")
    parser.add_argument("--seed", type=int, default=0, help="of the first injection of each fault")
    parser.add_argument("--stops", type=int, default=200, help="stops and round trips to measure")
    parser.add_argument(
        "--valves", choices=tuple(NOMINAL), default="servo", help="of every arm (default servo)"
    )
    parser.add_argument("--write", type=Path, metavar="PAGE", help="put the table into this page")
    parser.add_argument("--json", action="store_true", help="print JSON instead of the table")
    parser.add_argument("--list", action="store_true", help="print the names and end")
    options = parser.parse_args()
    if options.list:
        print("\n".join(fault.name for fault in FAULTS))
        raise SystemExit(0)
    if options.write and not options.write.is_file():
        parser.error(f"{options.write}: no such page")
    if options.only and not _chosen(options.only) and "stop" not in options.only:
        parser.error(f"no fault is named {' or '.join(options.only)}; --list names them")
    return options


def _chosen(names: list[str] | None) -> list[Fault]:
    """Return the faults that are meant: a whole name means that one, a part all that have it."""
    if not names:
        return list(FAULTS)
    whole = [fault.name for fault in FAULTS]
    parts = [name for name in names if name not in whole]
    return [f for f in FAULTS if f.name in names or any(part in f.name for part in parts)]


if __name__ == "__main__":
    sys.exit(main())
