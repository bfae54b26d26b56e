"""What every rival is given, and what it answers.

A rival is called once with a `Subject` and answers with what edits it.  It may raise whatever its
library does: that is recorded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from service.template.affine import AffineTemplate

Array = NDArray[np.float64]
Faces = NDArray[np.int64]


@dataclass(frozen=True)
class Subject:
    """A mesh, and what is known of it.

    Attributes:
        vertices: ``[V, 3]`` in the normalised canonical frame (+Y up, +Z front, radius 0.6).
        faces: ``[F, 3]``.
        template: the variant, as edits move it (see `service.deform.followers`).
        f: ``[d]`` parameters, in the same scale.
        t: ``[3]`` where the template's origin lies.
    """

    vertices: Array
    faces: Faces
    template: AffineTemplate
    f: Array
    t: Array

    @cached_property
    def fitted(self) -> Array:
        """``[T, 3]`` the template's vertices over the mesh."""
        return self.template.decode(self.f) + self.t


@dataclass(frozen=True)
class Edit:
    """A change of one parameter.

    Attributes:
        name, index: of the parameter, in the template.
        factor: that it is multiplied by.
        df: ``[d]`` the change.
        truth: ``[V, 3]`` vertices after the true edit, where it is known; for upper bounds only.
    """

    name: str
    index: int
    factor: float
    df: Array
    truth: Array | None = None


@dataclass(frozen=True)
class Outcome:
    """An edited mesh.

    Attributes:
        vertices: ``[V, 3]``, in the input's order; or of another mesh.
        faces: of another mesh, which re-synthesis makes; None for the input's own.
    """

    vertices: Array
    faces: Faces | None = None


Editor = Callable[[Edit], Outcome]
Rival = Callable[[Subject], Editor]


def linear(subject: Subject, jacobian: NDArray[np.floating]) -> Editor:
    """An editor whose displacements are ``jacobian [V, 3, d]`` times the change."""

    def edit(change: Edit) -> Outcome:
        moved = jacobian[:, :, change.index] * change.df[change.index]
        return Outcome(subject.vertices + moved)

    return edit
