"""What comes over the wire, made fit for a terminal and for the journal."""

from google.protobuf.internal.enum_type_wrapper import EnumTypeWrapper


def printable(text: str, at_most: int = 400) -> str:
    r"""Escape everything that no font shows, as Python does: a newline becomes ``\n``.

    So nobody's name or number moves the cursor, colours the screen, begins a line of its own in
    the journal, or turns the writing round. What is longer than ``at_most`` characters is cut.
    """
    shown = text[:at_most]
    if shown.isprintable():
        return shown
    escaped = (c if c.isprintable() else ascii(c)[1:-1] for c in shown)
    return "".join(escaped)[:at_most]


def name_of(enum: EnumTypeWrapper, number: int) -> str:
    """Return a value's name in small letters; one of a newer daemon's as a number."""
    value = enum.DESCRIPTOR.values_by_number.get(number)
    return f"{enum.DESCRIPTOR.name} {number}" if value is None else str(value.name).lower()
