"""What every limit gives to the QP."""

from typing import Protocol

from controllers.arm import Array


class Limit(Protocol):
    """Rows of ``lower <= G dq <= upper`` on the step of the lengths dq, both sides in metres.

    ``pattern`` (rows, n_chambers) is True where G may be non-zero; it never changes.
    """

    pattern: Array

    def rows(self, lengths_m: Array, dt_s: float) -> tuple[Array, Array, Array]:
        """Return G (rows, n_chambers), lower and upper (rows,) at the given lengths."""
        ...
