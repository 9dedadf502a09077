"""Tables of the configuration's keys, from the models that read them."""

from collections.abc import Iterator
from typing import Any, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from pneuarm.service.configuration.configuration import Configuration, load
from tools.docs.kinds import as_toml, in_words
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
        several = several or get_origin(field.annotation) in (tuple, list)
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
        value = field.get_default(call_default_factory=True)
        return "" if isinstance(value, BaseModel) else as_toml(value)
    return "from the built-in arm" if _given(path) else "required"


def _given(path: str) -> bool:
    """Whether every built-in arm has this table, and so its required keys."""
    value: Any = load()
    for step in path.split(".") if path else ():
        value = getattr(value, step, None)
    return isinstance(value, BaseModel)


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
    return in_words(field.annotation, list(field.metadata))
