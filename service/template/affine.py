"""Templates whose every coordinate is affine in the parameters: decoding is one product.

The analytic decoder of the paper (section 3): parameters in, a mesh of fixed vertices and faces
out.  `base` and `jacobian` are plain arrays, so numpy and torch decode from the same definition.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress

import numpy as np
from numpy.typing import NDArray

from service.template.frames import Frames
from service.template.parameters import Derived, Parameter

Array = NDArray[np.float64]

TINY = np.finfo(float).tiny


@dataclass(frozen=True)
class AffineTemplate:
    """A rigid category's template; lengths are linear in the parameters and in any unit.

    Attributes:
        name, label: of the category.
        points: size of the point clouds that its encoder takes.
        parameters: the ``d`` parameters, in order.
        derived: further dimensions by name.
        relations: ``[r, 1 + d]`` affine rows that are non-negative on sensible shapes.
        relation_texts: the same as the file writes them.
        base: ``[V, 3]`` vertices at all-zero parameters.
        jacobian: ``[V, 3, d]``; vertices are ``base + jacobian @ f``.
        faces: ``[F, 3]`` int64, counter-clockwise from outside.
        part: ``[V]`` int64, which of `parts` a vertex belongs to.
        parts: names of the ``P`` parts.
        hidden: ``[F]`` bool, faces inside the shape, never seen from outside.
        frame_base, frame_jacobian: ``[P, 3, 4]`` and ``[P, 3, 4, d]``; a part is the image of a
            fixed unit shape under its frame, ``frame @ [u, 1]``, to which a part that tapers adds
            ``u[run] taper @ u``.
        taper_base, taper_jacobian: ``[P, 3, 3]`` and ``[P, 3, 3, d]``.
        run: ``[P]`` int64, the axis along which each part tapers and leans.
        anchors: ``[1 + d]`` rows a coordinate, by name: points an edit can hold in place.
        present: which parts each variant has, ``[P]`` by its name, the usual variant first; empty
            where all shapes have all parts.
        variant: which of them this one is, restricted to its parts; empty for the whole.
    """

    name: str
    label: str
    points: int
    parameters: tuple[Parameter, ...]
    derived: dict[str, Derived]
    relations: Array
    relation_texts: tuple[str, ...]
    base: Array
    jacobian: Array
    faces: NDArray[np.int64]
    part: NDArray[np.int64]
    parts: tuple[str, ...]
    hidden: NDArray[np.bool_]
    frame_base: Array
    frame_jacobian: Array
    taper_base: Array
    taper_jacobian: Array
    run: NDArray[np.int64]
    anchors: dict[str, Array]
    present: dict[str, NDArray[np.bool_]]
    variant: str = ""

    @cached_property
    def variants(self) -> tuple[AffineTemplate, ...]:
        """The template of each variant, with its own parts only: what a shape is fitted by.

        They share the parameters; one that moves none of a variant's parts is idle there, and
        relations with it do not hold.
        """
        if not self.present:
            return (self,)
        return tuple(self._restricted(name, has) for name, has in self.present.items())

    def _restricted(self, name: str, has: NDArray[np.bool_]) -> AffineTemplate:
        own_vertex, own_face = has[self.part], has[self.part[self.faces[:, 0]]]
        vertex, part = np.cumsum(own_vertex) - 1, np.cumsum(has) - 1
        own = replace(
            self,
            base=self.base[own_vertex],
            jacobian=self.jacobian[own_vertex],
            faces=vertex[self.faces[own_face]],
            part=part[self.part[own_vertex]],
            parts=tuple(np.array(self.parts)[has].tolist()),
            hidden=self.hidden[own_face],
            frame_base=self.frame_base[has],
            frame_jacobian=self.frame_jacobian[has],
            taper_base=self.taper_base[has],
            taper_jacobian=self.taper_jacobian[has],
            run=self.run[has],
            present={},
            variant=name,
        )
        held = ~(self.relations[:, 1:][:, ~own.active] != 0.0).any(axis=1)
        return replace(
            own,
            relations=self.relations[held],
            relation_texts=tuple(compress(self.relation_texts, held.tolist())),
        )

    @property
    def active(self) -> NDArray[np.bool_]:
        """``[d]`` the parameters that move anything."""
        return np.asarray(self.jacobian.any(axis=(0, 1)))

    def vector(self, values: Mapping[str, float]) -> Array:
        """Parameters ``[d]`` by their names.

        Nuisance parameters that are not named are 0, or where they may not be the end of their
        range that is nearest to it.

        Raises:
            KeyError: for a public parameter that is missing.
        """
        return np.array(
            [
                values.get(p.name, min(max(p.low, 0.0), p.high)) if p.nuisance else values[p.name]
                for p in self.parameters
            ]
        )

    @property
    def names(self) -> tuple[str, ...]:
        """The parameter names, in order."""
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def stands(self) -> bool:
        """Shapes of the category stand on a floor: that is what an edit holds in place first."""
        return next(iter(self.anchors)) == "floor"

    @property
    def public(self) -> NDArray[np.bool_]:
        """``[d]`` the parameters that users see: all but the nuisance ones."""
        return np.array([not parameter.nuisance for parameter in self.parameters])

    @property
    def signed(self) -> NDArray[np.bool_]:
        """``[d]`` the parameters that may be negative."""
        return np.array([parameter.signed for parameter in self.parameters])

    @property
    def low(self) -> Array:
        """``[d]`` lower ends of the ranges."""
        return np.array([parameter.low for parameter in self.parameters])

    @property
    def high(self) -> Array:
        """``[d]`` upper ends of the ranges."""
        return np.array([parameter.high for parameter in self.parameters])

    def decode(self, f: Array) -> Array:
        """Vertices for parameters: ``f [..., d]`` to ``[..., V, 3]``."""
        return self.base + np.einsum("vcd,...d->...vc", self.jacobian, f)

    def frames(self, f: Array) -> Array:
        """``[P, 3, 4]`` map from each part's unit shape to space, for ``f [d]``, less its taper."""
        return self.frame_base + self.frame_jacobian @ f

    def maps(self, f: Array) -> Frames:
        """The whole map of each part, tapers included, and its inverse, for ``f [d]``."""
        tapers = self.taper_base + self.taper_jacobian @ f
        return Frames(self.frames(f), tapers, self.run)

    def following(self, f: Array) -> Array:
        """``[d, d]`` changes of all parameters for changes of those named, from ``f [d]`` on.

        The identity, but that a nuisance parameter which follows others goes along with them: a
        high wing stays on top of a taller fuselage, a T-tail on the tip of a longer fin.
        """
        matrix = np.eye(len(f))
        for index, parameter in enumerate(self.parameters):
            if parameter.follows is not None:
                matrix[index] += parameter.follows.row(f)
        return matrix

    def broken_relations(self, f: Array) -> list[str]:
        """The relations that parameters ``f [d]`` do not keep, as the file writes them."""
        kept = self.relations[:, 0] + self.relations[:, 1:] @ f >= 0.0
        return [
            text for text, is_kept in zip(self.relation_texts, kept, strict=True) if not is_kept
        ]

    @cached_property
    def limiting(self) -> NDArray[np.bool_]:
        """``[r]`` the relations that say something of the parts' maps, which move a mesh.

        The others are about sections that swell or shift: they tell which shapes there are, and a
        mesh has its own sections, which an edit of its size keeps in proportion.
        """
        maps = np.concatenate([self.frame_jacobian, self.taper_jacobian], axis=2)
        shaping = self.active & ~np.asarray(maps.any(axis=(0, 1, 2)))
        return ~np.asarray(self.relations[:, 1:][:, shaping].any(axis=1))

    def anchor(self, name: str) -> tuple[Array, Array]:
        """Constant ``[3]`` and Jacobian ``[3, d]`` of the point that an edit can hold in place."""
        rows = self.anchors[name]
        return rows[:, 0], rows[:, 1:]

    def face_areas(self, vertices: Array) -> Array:
        """``[F]`` areas of the faces for ``vertices [V, 3]``."""
        areas: Array = 0.5 * np.linalg.norm(self._crosses(vertices), axis=-1)
        return areas

    def normals(self, vertices: Array) -> Array:
        """``[V, 3]`` unit vertex normals: area-weighted means over the faces that meet there."""
        crosses = self._crosses(vertices)
        normals = np.zeros_like(vertices)
        for corner in range(3):
            np.add.at(normals, self.faces[:, corner], crosses)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        return normals / np.maximum(length, TINY)

    def _crosses(self, vertices: Array) -> Array:
        a, b, c = (vertices[self.faces[:, corner]] for corner in range(3))
        return np.cross(b - a, c - a)
