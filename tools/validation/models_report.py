"""The comparison of the models as JSON, Markdown and a picture.

``python -m tools.validation.models_report [--out DIR] [--samples N]``.
"""

import argparse
import json
from pathlib import Path

from pneuarm.controllers.arm.arm import Arm
from pneuarm.service.configuration.configuration import load
from pneuarm.service.validation.gravity import fit_rows
from pneuarm.service.validation.table1 import identify, read_table
from tools.validation.markdown import markdown_table
from tools.validation.models import MOUNTINGS, ModelResult, NearStraight, as_json, compare
from tools.validation.models_picture import draw


def paper_arm() -> Arm:
    """Return the arm of the paper's section 4."""
    return load(None, "paper").build_arm()


def table1_weight_over_bending_per_m3() -> float:
    """Weight a metre of rest length over the bending stiffness, as table 1 has it, all rows."""
    table = read_table()
    arm = identify(table)
    rows = list(range(len(table.printed["pressure_bar"])))
    return fit_rows(table, arm, rows).weight_over_bending_per_m2 / arm.rest_length_m


def errors_table(results: list[ModelResult]) -> str:
    """Return the mean and worst error of every model and mounting, percent of the length."""
    rows = [
        [
            result.name,
            *(
                f"{_percent(result.mean_percent[name])} / {_percent(result.worst_percent[name])}"
                for name in MOUNTINGS
            ),
        ]
        for result in results
    ]
    return markdown_table(["model", *(f"{name}: mean / worst %" for name in MOUNTINGS)], rows)


def failures_table(results: list[ModelResult]) -> str:
    """Return where every model fails, and its time."""
    asymmetries = list(results[0].near_straight)
    heading = ["model", "NaN in the samples", *(f"{_metres(text)}: %" for text in asymmetries)]
    rows = [
        [
            result.name,
            f"{100 * result.nan_share:.1f} %",
            *(_near(result.near_straight[text]) for text in asymmetries),
            f"{result.one_us:.0f}",
            f"{result.batch_us:.2f}",
        ]
        for result in results
    ]
    return markdown_table([*heading, "one call, us", "in a batch, us"], rows)


def _metres(text: str) -> str:
    return "straight" if float(text) == 0.0 else f"{text} m"


def _near(found: NearStraight) -> str:
    if found.worst_percent is None:
        return "**NaN**"
    nan = f"{100 * found.nan_share:.0f} % **NaN**, " if found.nan_share else ""
    return nan + _percent(found.worst_percent)


def _percent(value: float) -> str:
    if value < 1e-9:
        return "0"
    return f"{value:.1e}" if value < 1e-3 else f"{value:.3g}"


def write(directory: Path, count: int) -> list[ModelResult]:
    """Compare, and write models.json, models.md and models.png into ``directory``."""
    weight, arm = table1_weight_over_bending_per_m3(), paper_arm()
    results = compare(arm, weight, count)
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "models.json").write_text(json.dumps(as_json(results), indent=1) + "\n")
    tables = f"{errors_table(results)}\n\n{failures_table(results)}\n"
    (directory / "models.md").write_text(tables)
    draw(arm, weight, directory / "models.png")
    return results


def main() -> None:
    """Write the files and print the tables."""
    parser = argparse.ArgumentParser(description="Compare the models of the arm's shape.")
    parser.add_argument("--out", type=Path, default=Path("."), metavar="DIR")
    parser.add_argument("--samples", type=int, default=1000)
    arguments = parser.parse_args()
    results = write(arguments.out, arguments.samples)
    print(errors_table(results) + "\n\n" + failures_table(results))


if __name__ == "__main__":
    main()
