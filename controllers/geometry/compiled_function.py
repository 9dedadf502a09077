"""CasADi functions of arrays, called through CasADi's buffer interface: the only place that does.

CasADi stores by columns, numpy by rows: what is transposed here lies in its buffer in C order.
"""

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from pneuarm.controllers.arm.arm import Array


class CompiledFunction:
    """A call costs half a microsecond, and allocates nothing.

    ``arguments`` are flat arrays (numel,) which a call reads, ``results`` arrays of the given
    shapes, in C order, which every call overwrites; a column is a flat array too. ``evaluate()``
    reads the arguments where they stand; it does not keep this object alive.
    """

    def __init__(self, name: str, arguments: Sequence[ca.SX], results: Sequence[ca.SX]) -> None:
        self._function = ca.Function(
            name, arguments, ca.cse([ca.densify(result.T) for result in results])
        )
        self._buffer: Any  # CasADi's stubs do not know its own default arguments
        self.evaluate: Callable[[], None]
        self._buffer, self.evaluate = self._function.buffer()
        self.results = [np.zeros(_shape(result)) for result in results]
        for index, array in enumerate(self.results):
            self._buffer.set_res(index, array.data)
        self.bind([np.zeros(argument.numel()) for argument in arguments])

    def bind(self, arguments: Sequence[Array]) -> None:
        """Read the arguments from these arrays, of any shape in C order, from now on."""
        self.arguments = list(arguments)
        for index, array in enumerate(arguments):
            self._buffer.set_arg(index, array.data)

    def __call__(self, *values: Array) -> list[Array]:
        """Evaluate at copies of the values, arrays of as many elements; return ``results``."""
        for own, given in zip(self.arguments, values, strict=True):
            own[...] = given.reshape(own.shape)
        self.evaluate()
        return self.results

    def columns(self, *values: Array) -> Array:
        """Evaluate for every column of arguments (numel, batch); the one result, (numel, batch)."""
        return np.asarray(self._function(*values))


def _shape(result: ca.SX) -> tuple[int, ...]:
    rows, columns = result.shape
    return (rows,) if columns == 1 else (rows, columns)
