"""Every key of the configuration, with every kind of wrong value, and each bound and beyond it."""

from collections.abc import Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any, get_args

import annotated_types
import pytest
import tomli_w
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.service.configuration.configuration import Configuration, check, load

Where = tuple[str | int, ...]


def model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(filter(None, map(model_in, get_args(annotation))), None)


def keys(model: type[BaseModel], where: Where = ()) -> Iterator[tuple[Where, FieldInfo]]:
    """Yield every key there is, with where it stands; in lists of tables, that of the first."""
    for name, field in model.model_fields.items():
        yield (*where, name), field
        inner = model_in(field.annotation)
        if inner is not None and where[:2] != ("simulator", "arm"):
            listed = "tuple" in str(field.annotation)
            yield from keys(inner, (*where, name, 0) if listed else (*where, name))


KEYS = dict(keys(Configuration))
BASE = load().model_dump(exclude_none=True)
WRONG = [
    *(None, True, -1, 0, 10**400, 16**6000, 1e-300, 1e300, float("nan"), float("inf")),
    *("", "x", "a\0b", "a\nb", "\x1b[2J", "é" * 5000, "~nobody-of-this-name/x"),
    *([], [[]], {}, {"x": 1}, [1, 2, 3], [float("nan")] * 3),
]


def bounds(field: FieldInfo) -> list[float]:
    """Each bound, and what is a little and much beside it."""
    found: list[float] = []
    for note in field.metadata:
        for kind in ("gt", "ge", "lt", "le"):
            if isinstance(note, getattr(annotated_types, kind.capitalize())):
                bound = getattr(note, kind)
                found += [bound, bound - 1, bound + 1, bound * (1 + 1e-9), bound * (1 - 1e-9)]
    return found


def with_key(where: Where, value: object) -> dict[str, Any]:
    tables: dict[str, Any] = deepcopy(BASE)
    tables["arm"] |= {"keep_outs": [{"shape": "sphere", "center_mm": [900, 0, 0], "radius_mm": 9}]}
    place: Any = tables
    for step in where[:-1]:
        place = place.setdefault(step, {}) if isinstance(step, str) else place[step]
    place[where[-1]] = value
    return tables


def refusal(where: Where, value: object) -> str | None:
    """What is said of a value; None where it makes a configuration that all of it can be built of.

    The compiled step is left out: it takes a tenth of a second.
    """
    try:
        configuration = check(with_key(where, value), "own.toml")
    except ConfigurationError as error:
        return str(error)
    configuration.build_arm()
    configuration.build_simulated_arm()
    configuration.control.settings()
    configuration.feedback.settings()
    configuration.reference.limits()
    configuration.frames.frames()
    configuration.to_toml()
    return None


@pytest.mark.slow
@pytest.mark.parametrize("where", KEYS, ids=lambda where: ".".join(map(str, where)))
def test_a_value_is_refused_with_its_key_or_can_be_built_of(where: Where) -> None:
    told = [(value, refusal(where, value)) for value in [*WRONG, *bounds(KEYS[where])]]
    refused = [(value, text) for value, text in told if text is not None]
    assert refused
    for value, text in refused:
        assert str(where[0]) in text, (value, text)
        for line in text.split("\n"):
            assert line.startswith("own.toml: "), (value, text)
            assert line.isprintable(), (value, text)
            assert len(line) <= 2000


@pytest.mark.parametrize(
    ("text", "facts"),
    [
        ("[control]\nrate_hz = " + "9" * 6000, ("TOML",)),
        ("[control]\nrate_hz = 0x" + "f" * 6000, ("control.rate_hz",)),
        ("[control]\nrate_hz" + ".a" * 900 + " = 1", ("control.rate_hz",)),
        ('[rerun]\nbind = "localhost"', ("rerun.bind", "'localhost'", "127.0.0.1")),
        ('[rerun]\nbind = "[::1]"', ("rerun.bind", "'[::1]'", "::1")),
        ('[zenoh]\nlisten = ["tcp/127.0.0.1:99999"]', ("zenoh.listen[0]", "99999", "65535")),
        ('[zenoh]\nlisten = ["tcp/127.0.0.1:9876"]', ("rerun.port", "9876")),
        ('[zenoh]\nlisten = ["tcp/127.0.0.1:1", "tcp/[::1]:1"]', ("zenoh.listen", "port 1")),
        ('["a\\nb"]\nx = 1', (r"a\nb",)),
    ],
    ids=range(9),
)
def test_what_a_file_may_say_is_refused_with_the_facts(
    text: str, facts: tuple[str, ...], tmp_path: Path
) -> None:
    (tmp_path / "own.toml").write_text(text)
    with pytest.raises(ConfigurationError) as refused:
        load(tmp_path / "own.toml")
    assert all(fact in str(refused.value) for fact in facts)


def test_a_viewer_on_ipv6_has_an_address() -> None:
    from pneuarm.service.configuration.configuration import rerun_url

    tables = load().model_dump(exclude_none=True)
    tables["rerun"] |= {"bind": "::1", "port": 9999}
    assert rerun_url(check(tables)) == "rerun+http://[::1]:9999/proxy"


def test_the_mark_of_an_editor_is_no_mistake(tmp_path: Any) -> None:
    path = tmp_path / "own.toml"
    path.write_bytes(b"\xef\xbb\xbf" + tomli_w.dumps({"control": {"rate_hz": 500.0}}).encode())
    assert load(path).control.rate_hz == 500.0
