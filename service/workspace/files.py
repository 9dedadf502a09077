"""A workspace as files that other programs read: the mesh as PLY, the samples as NPZ."""

from pathlib import Path

import numpy as np

from pneuarm.controllers.workspace.mesh import Mesh
from pneuarm.controllers.workspace.sampling import Samples

_HEADER = """ply
format binary_little_endian 1.0
comment {comment}
element vertex {vertices}
property double x
property double y
property double z
element face {faces}
property list uchar int vertex_indices
end_header
"""
_FACE = np.dtype([("corners", "u1"), ("vertices", "<i4", (3,))])


def write_ply(path: Path, mesh: Mesh, arm: str) -> None:
    """Write the mesh in metres, binary, in double precision."""
    kind = "outer hull of the workspace" if mesh.outer_hull else "boundary of the workspace"
    header = _HEADER.format(
        comment=f"{kind} of the arm {arm}, in metres in the base frame",
        vertices=len(mesh.vertices_m),
        faces=len(mesh.triangles),
    )
    faces = np.empty(len(mesh.triangles), dtype=_FACE)
    faces["corners"], faces["vertices"] = 3, mesh.triangles
    vertices = mesh.vertices_m.astype("<f8")
    path.write_bytes(header.encode("ascii") + vertices.tobytes() + faces.tobytes())


def write_npz(path: Path, samples: Samples) -> None:
    """Write the samples; the names of the arrays are those of Samples, with their units."""
    np.savez_compressed(
        path,
        positions_m=samples.positions_m,
        lengths_m=samples.lengths_m,
        pressures_pa=samples.pressures_pa,
        manipulability=samples.manipulability,
        condition=samples.condition,
    )
