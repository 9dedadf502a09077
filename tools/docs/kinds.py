"""What a key takes, in words: its type with its bounds, and its default as a file has it."""

from typing import Any, Literal, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from pneuarm.hardware.tables.table import LARGEST, SMALLEST

#: What a number without bounds may be.
_ANY = "finite number"


def as_toml(value: object) -> str:
    """Return a value as a file has it."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple | list):
        return "[" + ", ".join(as_toml(item) for item in value) + "]"
    return f'"{value}"' if isinstance(value, str) else str(value)


def in_words(annotation: Any, bounds: list[Any]) -> str:
    """Return in words what a type with its bounds takes."""
    if hasattr(annotation, "__metadata__"):
        inner = [part for item in annotation.__metadata__ for part in _metadata(item)]
        return in_words(annotation.__origin__, [*inner, *bounds])
    if get_origin(annotation) is Literal:
        return ", ".join(as_toml(value) for value in get_args(annotation))
    arguments = [part for part in get_args(annotation) if part is not type(None)]
    if get_origin(annotation) in (tuple, list):
        return _list(arguments, bounds)
    if arguments:  # X | None
        return in_words(arguments[0], bounds)
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
    each = in_words(items[0], [])
    if len(items) > 1 and Ellipsis not in items:
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
        if bound in (Ge(-LARGEST), Le(LARGEST)):
            continue  # a number at all, which the page says once
        if isinstance(bound, Ge):
            low = "above 0" if bound.ge == SMALLEST else f"{bound.ge:.10g}"
        elif isinstance(bound, Gt):
            low = f"above {bound.gt:.10g}"
        elif isinstance(bound, Le):
            high = f"{bound.le:.10g}"
        elif isinstance(bound, Lt):
            high = f"below {bound.lt:.10g}"
    if not high:
        return low if "above" in low else f"{low} or more" if low else _ANY
    if not low:
        return high if "below" in high else f"at most {high}"
    if "below" in high:
        return f"{low} or more, {high}"
    return f"{low}, to {high}" if "above" in low else f"{low} to {high}"
