"""`pneuarm validate`."""

import argparse
import json

from pneuarm.service.validation.table1 import read_table
from pneuarm.service.validation.table1_report import parameters_text, table1_report, table_cells


def validate(arguments: argparse.Namespace) -> int:
    """Print table 1 computed again: positions in mm as y / z, errors in percent."""
    report = table1_report(read_table(arguments.table))
    if arguments.json:
        print(json.dumps(report))
        return 0
    cells = table_cells(report)
    widths = [max(len(line[column]) for line in cells) for column in range(len(cells[0]))]
    print("Tip as y / z in mm, two chambers under pressure")
    for line in cells:
        print("  ".join(text.rjust(width) for text, width in zip(line, widths, strict=True)))
    print(parameters_text(report))
    return 0
