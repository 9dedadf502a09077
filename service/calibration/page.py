"""calibration.html: what was fitted and how well, in one file that needs no other."""

import base64
import html
import time

import numpy as np

from pneuarm.controllers.calibration.calibrate import Calibration
from pneuarm.service.calibration.pictures import pictures
from pneuarm.service.calibration.values import (
    Value,
    coupling_deviations,
    residuals_text,
    values,
    worth_text,
)

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; margin: 2em auto; max-width: 72em; padding: 0 1em;
       color: #222; background: #fff; }
table { border-collapse: collapse; margin: 1em 0; }
th, td { padding: 0.25em 0.9em; text-align: right; border-bottom: 1px solid #ddd; }
th { border-bottom: 2px solid #888; }
td:first-child, th:first-child { text-align: left; }
tr.unseen td { color: #888; }
figure { margin: 2em 0; } img { max-width: 100%; } figcaption { color: #555; }
"""


def page(calibration: Calibration) -> str:
    """Return the page."""
    name = html.escape(calibration.arm.name)
    when = time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime())
    sentence = residuals_text(calibration)
    note = f"<p>{html.escape(calibration.note)}.</p>" if calibration.note else ""
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Calibration of {name}</title>
<style>{_STYLE}</style></head><body>
<h1>Calibration of arm {name}</h1>
<p>{when}. {sentence[0].upper()}{html.escape(sentence[1:])}.</p>
<p>Worth: {html.escape(worth_text(calibration))}.</p>{note}
<h2>Parameters</h2>
{_parameters(values(calibration))}
<h2>Coupling</h2>
{_couplings(calibration)}
<h2>Pictures</h2>
{"".join(_figure(*each) for each in pictures(calibration).items())}
</body></html>
"""


def _parameters(found: list[Value]) -> str:
    heading = ("section", "parameter", "unit", "before", "after", "standard deviation")
    rows = [
        _row(
            (
                str(value.section or "arm"),
                value.key,
                value.unit,
                f"{value.before:.5g}",
                f"{value.after:.5g}",
                f"{value.deviation:.2g}",
            ),
            "" if value.seen else ' class="unseen"',
        )
        for value in found
    ]
    unseen = (
        "<p>Grey: hardly seen in this motion, so it stays near what was configured.</p>"
        if not all(value.seen for value in found)
        else ""
    )
    return f"<table><tr>{_cells(heading, 'th')}</tr>{''.join(rows)}</table>{unseen}"


def _couplings(calibration: Calibration) -> str:
    tables = []
    for index, section in enumerate(calibration.arm.sections):
        deviations = coupling_deviations(calibration, index)
        rows = [
            _row((f"chamber {i + 1} lengthens", *(f"{v:+.3f} &plusmn; {s:.3f}" for v, s in cells)))
            for i, cells in enumerate(
                np.stack([np.array(section.coupling), deviations], axis=-1).tolist()
            )
        ]
        heading = (f"section {index + 1}", *(f"by chamber {j}" for j in (1, 2, 3)))
        tables.append(f"<table><tr>{_cells(heading, 'th')}</tr>{''.join(rows)}</table>")
    return "".join(tables)


def _row(cells: tuple[str, ...], attributes: str = "") -> str:
    return f"<tr{attributes}>{_cells(cells, 'td')}</tr>"


def _cells(cells: tuple[str, ...], tag: str) -> str:
    return "".join(f"<{tag}>{cell}</{tag}>" for cell in cells)


def _figure(caption: str, png: bytes) -> str:
    data = base64.b64encode(png).decode()
    return (
        f'<figure><img alt="" src="data:image/png;base64,{data}">'
        f"<figcaption>{html.escape(caption)}</figcaption></figure>\n"
    )
