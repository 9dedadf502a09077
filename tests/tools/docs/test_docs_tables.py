"""What writes tables into the documents: prose stays, places are filled, the code is told whole."""

from typing import Annotated, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field, create_model

from pneuarm.hardware.tables.table import Finite, Positive, Table
from tools.docs import configuration, messages
from tools.docs.pages import make
from tools.docs.regions import NoSuchTable, filled, linked, names, table

PLACE = "<!-- made by make docs: {} -->\n{}<!-- end -->"
prose = st.text().filter(lambda text: "<!--" not in text)


@given(prose, prose, st.sampled_from(["", "old\n", "| a |\n\n"]))
def test_only_what_stands_in_a_place_is_written(before: str, after: str, old: str) -> None:
    page = f"{before}{PLACE.format('x y', old)}{after}"
    made = filled(page, lambda name: f"[{name}]")
    assert made == f"{before}{PLACE.format('x y', chr(10) + '[x y]' + chr(10) * 2)}{after}"
    assert filled(made, lambda name: f"[{name}]") == made
    assert names(made) == ["x y"]


@pytest.mark.parametrize("name", ["nothing", "configuration nowhere", "message Nobody"])
def test_what_nothing_makes_is_refused_by_its_name(name: str) -> None:
    with pytest.raises(NoSuchTable, match=name.split()[-1]):
        make(name)


def test_a_cell_is_one_line_and_holds_no_bar() -> None:
    assert table(("a", "b"), [("one\n two", "x | y")]).splitlines()[-1] == "| one two | x \\| y |"


def test_pages_and_tables_become_links() -> None:
    assert linked("see docs/wire.md#keys") == "see [wire.md](wire.md#keys)"
    assert linked("`[arm.response]`") == "[`[arm.response]`](#armresponse)"


@pytest.mark.parametrize(
    ("kind", "default", "cells"),
    [
        (Positive, 1.5, ["1.5", "above 0"]),
        (Annotated[float, Field(ge=0, lt=3)], 1.0, ["1.0", "0 or more, below 3"]),
        (Annotated[int, Field(ge=1, le=98)], 80, ["80", "1 to 98, whole"]),
        (Annotated[Positive, Field(le=7)], 2.0, ["2.0", "above 0, to 7"]),
        (Annotated[float, Field(le=7)], 2.0, ["2.0", "at most 7"]),
        (Literal["a", "b"], "a", ['"a"', '"a", "b"']),
        (bool, True, ["true", "true, false"]),
        (Finite | None, None, ["none", "finite number"]),
        (tuple[Finite, Finite, Finite], (0.0, 0.0, 1.0), ["[0.0, 0.0, 1.0]", "3 finite numbers"]),
        (
            Annotated[tuple[Annotated[int, Field(ge=0, le=2)], ...], Field(max_length=3)],
            (),
            ["[]", "a list of up to 3, each 0 to 2, whole"],
        ),
    ],
)
def test_default_and_bounds_are_told_of_every_kind_of_key(
    kind: object, default: object, cells: list[str]
) -> None:
    model = create_model("Model", __base__=Table, width_mm=(kind, default))
    row = configuration.table_of("", model).splitlines()[-1]
    assert [cell.strip() for cell in row.split("|")[2:5]] == ["mm", *cells]


def test_every_message_of_the_wire_is_told_with_all_its_fields() -> None:
    for name, message in messages.messages().items():
        told = messages.make_message(f"message {name}")
        for field in message.fields:
            assert f"| `{field.name}` |" in told


def test_the_comments_of_the_proto_reach_the_page() -> None:
    assert "one bit each" in messages.make_message("message ArmState")
    assert "exactly one of these 11" in messages.make_message("message Target")
