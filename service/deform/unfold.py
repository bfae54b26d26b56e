"""Local repair of the folds that an edit would press into a mesh.

Where a mesh differs from its template, neighbours may follow different parts so far apart that
the faces between them turn inside out.  The repair evens the Jacobian out right there: first over
the shortest edges of the faces that fold (slivers), then over their surroundings.  It keeps the
binding linear, and is kept itself only as far as fewer faces fold.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from service.deform.binding import Binding
from service.deform.flips import flipped
from service.deform.weld import weld

Array = NDArray[np.float64]
Index = NDArray[np.int64]

STRONG = (0.7, 1.4)
"""Edits that a bound mesh should take without folding, as factors of a parameter."""
MERGES = 5
"""Rounds of evening out along short edges."""
RELAXATIONS = 12
"""Rounds of evening out around folds; each reaches one ring of vertices further."""
SWEEPS = 15
"""Averaging steps a round."""


def unfold(
    binding: Binding, vertices: Array, faces: Index, f: Array, parameters: Sequence[int]
) -> Binding:
    """The binding with fewer folds.

    Args:
        binding: of the mesh.
        vertices: ``[V, 3]`` of the mesh, in the frame that it was bound in.
        faces: ``[F, 3]``.
        f: ``[d]`` parameters that it was bound at.
        parameters: indices of those to look after.
    """
    jacobian = binding.jacobian
    mesh: _Mesh | None = None
    for index in parameters:
        changes = [np.where(np.arange(len(f)) == index, (k - 1) * f, 0.0) for k in STRONG]
        maps = [binding.linear(change) for change in changes]
        moves = [binding.displace(change) for change in changes]
        tests = zip(moves, maps, strict=True)
        if not any(flipped(vertices, vertices + move, faces, m).any() for move, m in tests):
            continue
        mesh = mesh or _Mesh.of(vertices, faces)
        column = jacobian[mesh.first, :, index].astype(np.float64)
        steps = [float(change[index]) for change in changes]
        folds = _Folds(mesh, steps, [m[mesh.first] for m in maps])
        if jacobian is binding.jacobian:
            jacobian = jacobian.copy()
        jacobian[:, :, index] = _repaired(folds, column)[mesh.of]
    return replace(binding, jacobian=jacobian)


@dataclass(frozen=True)
class _Mesh:
    """A welded mesh: vertices, faces, a vertex of the original for each and back, and edges."""

    vertices: Array
    faces: Index
    first: Index
    of: Index

    @classmethod
    def of_mesh(cls, vertices: Array, faces: Index) -> _Mesh:
        welded = weld(vertices, faces)
        first = np.zeros(len(welded.vertices), np.int64)
        first[welded.of[::-1]] = np.arange(len(vertices))[::-1]
        return cls(welded.vertices, welded.faces, first, welded.of)
