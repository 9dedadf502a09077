"""Forward kinematics of batches: the singularity-free form over blocks that fit the cache.

Frames are held as ``(3, 4, m)``, x, y and z axis and origin as columns, each coordinate contiguous
over the m configurations of a block. A section with the shape ``(L, u, v)`` carries
the frame ``(x, y, z, p)`` of its base to the one of its end by ::

    a = u x + v y                 n = C a + S z
    x' = x - u n    y' = y - v n    z' = S a + cos(theta) z    p' = p + L n

which is the product of the base frame with the section's transform (the paper's Eq. (1), in the
twist-free frame), written out.
"""

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.kinematics.smooth import s_and_c

#: Configurations in a block: its arrays stay within some MB of cache, and numpy's cost of a call
#: is spread over many.
BLOCK = 16384

#: Transforms written at a time: half a megabyte, still in the cache when the last row is added.
_WRITTEN = 4096

_SQRT_3 = np.sqrt(3.0)


def shapes_of_columns(lengths_m: Array, chamber_offset_m: Array | float) -> Array:
    """Shapes ``(3, m)`` of ``(L, u, v)`` from the three lengths ``(3, m)`` of one section."""
    first, second, third = lengths_m
    shapes = np.empty(lengths_m.shape)
    np.add(first, second, out=shapes[0])
    shapes[0] += third
    shapes[0] *= 1.0 / 3.0
    np.subtract(second, first, out=shapes[1])
    shapes[1] += third - first
    shapes[1] /= 3.0 * chamber_offset_m
    np.subtract(third, second, out=shapes[2])
    shapes[2] /= _SQRT_3 * chamber_offset_m
    return shapes


def first_frame(shapes: Array) -> Array:
    """Frames ``(3, 4, m)`` at the end of a section whose base is the identity."""
    arc_length, u, v = shapes
    frame = np.empty((3, 4, arc_length.size))
    x, y, z, p = (frame[:, column] for column in range(4))
    s, c = s_and_c(u * u + v * v)
    np.multiply(shapes[1:], c, out=p[:2])
    p[2] = s
    np.multiply(shapes[1:], s, out=z[:2])
    np.multiply(u, p[0], out=z[2])
    np.multiply(v, p[1], out=y[1])
    np.multiply(u, p[1], out=y[0])
    np.subtract(1.0, z[2], out=x[0])
    np.subtract(x[0], y[1], out=z[2])
    np.subtract(1.0, y[1], out=y[1])
    np.negative(y[0], out=y[0])
    x[1] = y[0]
    np.negative(z[:2], out=frame[2, :2])
    p *= arc_length
    return frame


def carry(frame: Array, shapes: Array) -> None:
    """Move the frames ``(3, 4, m)`` in place from the base to the end of a section."""
    arc_length, u, v = shapes
    x, y, z, p = (frame[:, column] for column in range(4))
    q = u * u + v * v
    s, c = s_and_c(q)
    a = u * x
    a += v * y
    n = c * a
    n += s * z
    z *= 1.0 - q * c
    a *= s
    z += a
    x -= np.multiply(u, n, out=a)
    y -= np.multiply(v, n, out=a)
    n *= arc_length
    p += n


def fill_section(shapes: Array, out: Array) -> None:
    """Write the transforms of one section, shapes ``(m, 3)``, to ``out`` ``(m, 4, 4)``."""
    for start in range(0, len(shapes), BLOCK):
        block = slice(start, start + BLOCK)
        _write(first_frame(np.ascontiguousarray(shapes[block].T)), out[block])


def fill_ends(lengths_m: Array, offsets_m: Array, bounds_m: Array, out: Array) -> bool:
    """Write the end transforms of all sections; return False at a length outside its bounds.

    ``lengths_m`` (m, n_sections, 3), ``offsets_m`` (n_sections,), ``bounds_m`` (2, n_sections, 3),
    the ends of open intervals. ``out`` is (m, n_sections, 4, 4), or (m, 1, 4, 4) for the tip alone.
    """
    n_sections, n_out = lengths_m.shape[1], out.shape[1]
    for start in range(0, len(lengths_m), BLOCK):
        block = slice(start, start + BLOCK)
        columns = np.ascontiguousarray(lengths_m[block].transpose(1, 2, 0))
        if not _inside(columns, bounds_m):
            return False
        frame = first_frame(shapes_of_columns(columns[0], offsets_m[0]))
        for index in range(n_sections):
            if index:
                carry(frame, shapes_of_columns(columns[index], offsets_m[index]))
            if index >= n_sections - n_out:
                _write(frame, out[block, index - n_sections])
    return True


def _inside(columns: Array, bounds_m: Array) -> bool:
    low, high = columns.min(axis=-1), columns.max(axis=-1)
    return bool(((low > bounds_m[0]) & (high < bounds_m[1])).all())  # a NaN is neither


def _write(frame: Array, out: Array) -> None:
    """Write frames ``(3, 4, m)`` as transforms ``(m, 4, 4)``."""
    flat, rows = out.reshape(-1, 16), frame.reshape(12, -1)
    for start in range(0, len(flat), _WRITTEN):
        chunk = slice(start, start + _WRITTEN)
        # Twelve at a time: numpy joins the axes, which is twice as fast as three by four.
        flat[chunk, :12] = rows[:, chunk].T
        flat[chunk, 12:15] = 0.0
        flat[chunk, 15] = 1.0
