"""The validation's document: its sections in their order, its tables."""

from pathlib import Path

from tools.validation.markdown import markdown_table
from tools.validation.report import SECTIONS, table1, write_document


def test_the_document_holds_its_sections_in_order(tmp_path: Path) -> None:
    path = write_document(tmp_path / "docs", (table1, lambda: "## Last"))
    titles = [line for line in path.read_text().splitlines() if line.startswith("#")]
    assert titles[0] == "# Validation"
    assert titles[1].startswith("## Table 1")
    assert titles[2:] == ["## Last"]


def test_every_part_of_the_validation_has_its_section() -> None:
    assert len(SECTIONS) == len(set(SECTIONS)) == 6


def test_markdown_tables_are_aligned() -> None:
    text = markdown_table(["a", "long"], [["xyz", "1"]])
    assert text.splitlines() == ["| a   | long |", "|-----|------|", "| xyz | 1    |"]
