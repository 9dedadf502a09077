"""Tables of the configuration's keys, from the models that read them."""

from collections.abc import Iterator
from importlib.resources import files
from typing import Any, Literal, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from pneuarm.service.configuration.configuration import PRESETS, Configuration, load
from tools.docs.regions import NoSuchTable, linked, table

HEADING = ("key", "unit", "default", "allowed", "meaning")

#: Unit of a key by the end of its name, the longest first.
UNITS = {
    "mm_per_bar2": "mm/bar^2",
    "mm_per_bar": "mm/bar",
    "deg_per_n_m": "deg/(N m)",
    "mm_per_n": "mm/N",
    "per_s": "1/s",
    "mm_s3": "mm/s^3",
    "mm_s2": "mm/s^2",
    "mm_s": "mm/s",
    "m_s2": "m/s^2",
    "bar_s": "bar/s",
    "minutes": "min",
    "percent": "%",
    "mbar": "mbar",
    "bar": "bar",
    "deg": "degrees",
    "baud": "baud",
    "mib": "MiB",
    "gib": "GiB",
    "mm": "mm",
    "ms": "ms",
    "us": "us",
    "hz": "Hz",
    "kg": "kg",
    "s": "s",
}

#: What a number without bounds may be.
_ANY = "finite number"

Model = type[BaseModel]


def tables() -> dict[str, Model]:
    """Every table by its path (`arm.sections`), in the order of the file; the whole is ``""``."""
    return dict(_tables(Configuration, ""))


def _tables(model: Model, path: str) -> Iterator[tuple[str, Model]]:
    yield path, model
    for key, field in model.model_fields.items():
        for inner in _models_in(field.annotation):
            if not _elsewhere(inner, f"{path}.{key}".lstrip(".")):
                yield from _tables(inner, f"{path}.{key}".lstrip("."))


def _elsewhere(model: Model, path: str) -> bool:
    """Whether a table is like one that stands at the top of the file, as [simulator.arm] is."""
    top = {
        inner: key
        for key, field in Configuration.model_fields.items()
        for inner in _models_in(field.annotation)
    }
    return top.get(model, path) != path


def _models_in(annotation: object) -> Iterator[Model]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from _models_in(argument)


def title(path: str) -> str:
    """Return how a file begins a table: `[arm]`, or `[[arm.sections]]` for each of several."""
    steps, model, several = path.split("."), Configuration, False
    for step in steps:
        field = model.model_fields[step]
        several = several or get_origin(field.annotation) is tuple
        model = next(_models_in(field.annotation))  # type: ignore[assignment]
    return f"[[{path}]]" if several else f"[{path}]"


def make(name: str) -> str:
    """Return the table of a path, or with `below PATH` those of all tables in it."""
    found, wanted = tables(), name.removeprefix("configuration").strip()
    if wanted.startswith("below "):
        above = wanted.removeprefix("below ")
        return "\n\n".join(_headed(path, found[path]) for path in found if _is_below(path, above))
    path = "" if wanted == "top" else wanted
    if path not in found:
        raise NoSuchTable(f"the configuration has no table {path!r}")
    return table_of(path, found[path])


def _is_below(path: str, above: str) -> bool:
    return path.startswith(f"{above}.")


def covered(name: str) -> set[str]:
    """Return the paths whose keys a place describes."""
    wanted = name.removeprefix("configuration").strip()
    if wanted.startswith("below "):
        return {path for path in tables() if _is_below(path, wanted.removeprefix("below "))}
    return {"" if wanted == "top" else wanted}


def _headed(path: str, model: Model) -> str:
    told = " ".join((model.__doc__ or "").split())
    return f"### `{title(path)}`\n\n{told}\n\n{table_of(path, model)}"


def table_of(path: str, model: Model) -> str:
    """Return the table of a model's keys."""
    rows = [
        [
            f"`{key}`",
            _unit(key),
            _default(path, field),
            _allowed(path, key, field),
            _meaning(path, key, field),
        ]
        for key, field in model.model_fields.items()
    ]
    return table(HEADING, rows)


def _unit(key: str) -> str:
    fitting = (unit for end, unit in UNITS.items() if key == end or key.endswith(f"_{end}"))
    return next(fitting, "")


def _default(path: str, field: FieldInfo) -> str:
    if not field.is_required():
        return "" if isinstance(field.default, BaseModel) else _toml(field.default)
    return "from the built-in arm" if _given(path) else "required"


def _given(path: str) -> bool:
    """Whether every built-in arm has this table, and so its required keys."""
    value: Any = load()
    for step in path.split(".") if path else ():
        value = getattr(value, step, None)
    return isinstance(value, BaseModel)


def _toml(value: object) -> str:
    """Return a value as a file has it."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    return f'"{value}"' if isinstance(value, str) else str(value)


def _meaning(path: str, key: str, field: FieldInfo) -> str:
    """Return the key's description, and where its own table is."""
    told = field.description or ""
    below = f"{path}.{key}".lstrip(".")
    see = f"see `{title(below)}`" if below in tables() else ""
    return linked("; ".join(part for part in (told, see) if part))


def _allowed(path: str, key: str, field: FieldInfo) -> str:
    models = list(_models_in(field.annotation))
    if models and f"{path}.{key}".lstrip(".") not in tables():
        top = next(name for name, model in tables().items() if model is models[0])
        return linked(f"a table like `{title(top)}`")
    return _of(field.annotation, list(field.metadata))


def _of(annotation: Any, bounds: list[Any]) -> str:
    """Return in words what a type with its bounds takes."""
    if hasattr(annotation, "__metadata__"):
        inner = [part for item in annotation.__metadata__ for part in _metadata(item)]
        return _of(annotation.__origin__, [*inner, *bounds])
    if get_origin(annotation) is Literal:
        return ", ".join(_toml(value) for value in get_args(annotation))
    arguments = [part for part in get_args(annotation) if part is not type(None)]
    if get_origin(annotation) is tuple:
        return _list(arguments, bounds)
    if arguments:  # X | None
        return _of(arguments[0], bounds)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return "a table"
    if annotation is bool:
        return "true, false"
    if annotation is str:
        return _text(bounds)
    return _range(bounds) + (", whole" if annotation is int else "")


def _metadata(item: Any) -> list[Any]:
    return list(item.metadata) if isinstance(item, FieldInfo) else [item]


def _list(items: list[Any], bounds: list[Any]) -> str:
    each = _of(items[0], [])
    if Ellipsis not in items:
        return f"{len(items)} {each}s" if each == _ANY else f"{len(items)} rows of {each}"
    least = next((bound.min_length for bound in bounds if isinstance(bound, MinLen)), 0)
    most = next((bound.max_length for bound in bounds if isinstance(bound, MaxLen)), None)
    many = f"{least} to {most}" if least and most else f"{least} or more"
    many = f"up to {most}" if most and not least else many
    return f"{many} entries" if each == "a table" else f"a list of {many}, each {each}"


def _text(bounds: list[Any]) -> str:
    most = next((bound.max_length for bound in bounds if isinstance(bound, MaxLen)), None)
    return "text" if most is None else f"text of at most {most} characters"


def _range(bounds: list[Any]) -> str:
    low, high = "", ""
    for bound in bounds:
        if isinstance(bound, Ge):
            low = f"{bound.ge:.10g}"
        elif isinstance(bound, Gt):
            low = f"above {bound.gt:.10g}"
        elif isinstance(bound, Le):
            high = f"{bound.le:.10g}"
        elif isinstance(bound, Lt):
            high = f"below {bound.lt:.10g}"
    if not high:
        return low if "above" in low else f"{low} or more" if low else _ANY
    if "below" in high:
        return f"{low} or more, {high}"
    return f"{low}, to {high}" if "above" in low else f"{low} to {high}"


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
