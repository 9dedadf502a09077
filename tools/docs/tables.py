"""The tables of modes, faults, exceptions, rooms, and of the built-in and the simulated arms."""

import ast
from dataclasses import fields
from importlib.resources import files
from pathlib import Path

from pneuarm.controllers.arm import errors
from pneuarm.hardware.simulator.parameters import NOMINAL, SimulatorParameters
from pneuarm.service.configuration.configuration import PRESETS, load
from pneuarm.service.modes.mode import TABLE, Mode, ModeEvent
from pneuarm.service.monitors.monitors import MONITORS
from pneuarm.service.safety.faults import FAULTS
from tools.docs.regions import linked, table

ROOT = Path(__file__).resolve().parents[2]
#: The packages, from the top down.
PACKAGES = ("service", "logs", "hardware", "controllers")


def make_modes(name: str) -> str:
    """Return what each event makes of each mode."""
    rows = []
    for event in ModeEvent:
        after = [TABLE.get((mode, event)) for mode in Mode]
        cells = ["" if mode is None else mode.name.lower() for mode in after]
        rows.append([f"`{event.name}`", linked(event.cause), *cells])
    return table(("event", "cause", *(mode.name.lower() for mode in Mode)), rows)


def make_faults(name: str) -> str:
    """Return every fault with its bit, its policy, its cause, what follows, and the remedy."""
    rows = []
    for fault in FAULTS.values():
        policy = fault.policy
        words = [policy.name.lower(), fault.cause, policy.consequence, fault.remedy]
        rows.append([f"`{fault.code}`", f"{1 << fault.bit}", *words])
    return table(("code", "bit", "policy", "cause", "consequence", "remedy"), rows)


def make_monitors(name: str) -> str:
    """Return what each monitor looks at, and how to set it, by the code of its fault."""
    rows = [
        [f"`{kind.fault.code}`", kind.looks_at, linked(kind.how_to_set, "configuration.md")]
        for kind in MONITORS
    ]
    return table(("code", "looks at", "how to set it"), rows)


def make_exceptions(name: str) -> str:
    """Return the tree of exceptions, each with the first sentence of what it says of itself."""
    return table(("exception", "a kind of", "means"), _below(errors.PneuarmError))


def _below(kind: type[Exception]) -> list[list[str]]:
    first = " ".join((kind.__doc__ or "").split()).partition(". ")[0].rstrip(".")
    rows = [[f"`{kind.__name__}`", f"`{kind.__bases__[0].__name__}`", first]]
    for inner in kind.__subclasses__():
        if inner.__module__ == errors.__name__:
            rows += _below(inner)
    return rows


#: Parameters that are those of the valves.
_VALVES = "valve_"


def make_simulator(name: str) -> str:
    """Return the nominal parameters of the simulated arm, but for its valves."""
    rows = [
        [f"`{part.name}`", str(part.default), _unit(part.name), part.metadata["meaning"]]
        for part in fields(SimulatorParameters)
        if not part.name.startswith(_VALVES)
    ]
    return table(("parameter", "nominal", "unit", "meaning"), rows)


def make_valves(name: str) -> str:
    """Return the nominal parameters of each kind of valves, side by side."""
    parts = {part.name: part for nominal in NOMINAL.values() for part in fields(nominal)}
    rows = []
    for part in parts.values():
        if part.name.startswith(_VALVES):
            values = [f"{getattr(nominal, part.name, '')}" for nominal in NOMINAL.values()]
            rows.append([f"`{part.name}`", *values, _unit(part.name), part.metadata["meaning"]])
    return table(("parameter", *(f"`{name}`" for name in NOMINAL), "unit", "meaning"), rows)


#: Unit of a parameter by the end of its name.
_UNITS = {
    "m3_s_pa": "m^3/(s Pa)",
    "kg_m": "kg/m",
    "m3": "m^3",
    "kg": "kg",
    "hz": "Hz",
    "pa": "Pa",
    "m": "m",
    "s": "s",
}


def _unit(name: str) -> str:
    return next((unit for end, unit in _UNITS.items() if name.endswith(f"_{end}")), "")


def make_rooms(name: str) -> str:
    """Return the rooms of the packages, each with what its `__init__.py` says of it."""
    inits = [
        init for package in PACKAGES for init in sorted((ROOT / package).glob("*/__init__.py"))
    ]
    rows = [[f"`{init.parent.relative_to(ROOT)}`", _docstring(init)] for init in inits]
    return table(("room", "what"), rows)


def _docstring(path: Path) -> str:
    return ast.get_docstring(ast.parse(path.read_text())) or ""


#: Keys of a section that the built-in arms are told apart by.
_COMPARED = (
    "rest_length_mm",
    "chamber_offset_mm",
    "length_min_mm",
    "length_max_mm",
    "bend_max_deg",
    "length_rate_max_mm_s",
    "length_acceleration_max_mm_s2",
    "pressure_min_bar",
    "pressure_max_bar",
    "pressure_slew_max_bar_s",
    "lengthening_mm_per_bar",
    "softening_mm_per_bar2",
)


def make_presets(name: str) -> str:
    """Return the built-in arms side by side; several values where the sections differ."""
    arms = [load(preset=preset) for preset in PRESETS]
    rows = [["what it is", *(_first_comment(preset) for preset in PRESETS)]]
    rows += [["sections", *(f"{len(arm.arm.sections)}" for arm in arms)]]
    rows += [["`rate_hz`", *(f"{arm.control.rate_hz:g}" for arm in arms)]]
    for key in _COMPARED:
        values = [
            ", ".join(dict.fromkeys(f"{getattr(part, key):g}" for part in arm.arm.sections))
            for arm in arms
        ]
        rows.append([f"`{key}`", *values])
    return table(["", *(f"`{preset}`" for preset in PRESETS)], rows)


def _first_comment(preset: str) -> str:
    """Return what a built-in arm's file says of itself at its head."""
    text = files("pneuarm.service.configuration").joinpath("presets", f"{preset}.toml").read_text()
    head = text.partition("\n\n")[0]
    return " ".join(line.removeprefix("#").strip() for line in head.splitlines())
