"""How the faces of a mesh turn while its vertices move: along one column of a Jacobian, or away.

A face whose sides are ``e1, e2`` and change by ``d1, d2`` a unit has, after a step s, the normal
``(e1 + s d1) x (e2 + s d2) = n0 + s n1 + s^2 n2``.  Few turn so far that they may have folded;
that is told of all in single precision, and only those few are looked at closely.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from service.deform.flips import counted, dot, wild
from service.deform.gradient import Gradient
from service.deform.normals import cross

Real = TypeVar("Real", bound=np.floating)
Array = NDArray[np.float64]
Array32 = NDArray[np.float32]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
Motion = Mapping[int, NDArray[np.floating]]

BLOCK = 16384
"""Faces at a time: what is worked out of them stays in the processor's cache."""
TURNED = 0.7
"""Squared share of a normal's length by which it may change without turning by 60 degrees, less
than sin(60)^2 by what single precision may be off."""
SLENDER = 1e-4
"""Sine of a corner's angle from which on single precision tells a normal to a thousandth."""


class Turning:
    """The faces of a mesh, and which of them fold."""

    def __init__(self, vertices: Array, faces: Index) -> None:
        """
        Args:
            vertices: ``[n, 3]``.
            faces: ``[F, 3]``.
        """
        self._corners = np.ascontiguousarray(faces.T)
        self._columns = np.ascontiguousarray(vertices.T)
        self._sides = np.empty((2, 3, len(faces)), np.float32)
        squared = np.empty(len(faces))
        for rows in self._blocks():
            sides = _sides(self._columns, self._corners[:, rows])
            self._sides[:, :, rows] = sides
            normal = cross(*sides)
            squared[rows] = dot(normal, normal)
        # Faces that don't count may turn as they like.
        self._room = np.where(counted(squared), TURNED * squared, np.inf).astype(np.float32)

    def folded(
        self, motion: Motion, gradient: Gradient, wild: Mask, steps: Sequence[float]
    ) -> Mask:
        """``[len(steps), F]`` which faces fold in each step.

        Args:
            motion: ``[n]`` displacement a unit along the axes that have any.
            gradient: how a unit changes the maps.
            wild: ``[n]`` of `Gradient.wild` for these steps.
            steps: changes of the parameter.
        """
        folded = np.zeros((len(steps), self._corners.shape[1]), bool)
        rows = self._suspects(motion, wild, max(abs(step) for step in steps))
        if not len(rows):
            return folded
        corners = self._corners[:, rows]
        sides = _sides(self._columns, corners)
        changes = np.zeros_like(sides)
        for axis, column in motion.items():
            changes[:, axis] = _differences(column, corners)
        turned, expected = (
            cross(*(sides[:, :, None] + np.multiply.outer(steps, change).transpose(1, 2, 0, 3)))
            for change in (changes, gradient.carried(corners, sides))
        )
        folded[:, rows] = dot(turned, expected) < 0.0
        return folded

    def flipped(self, moved: NDArray[np.floating], maps: NDArray[np.floating]) -> Index:
        """Faces of some area whose normal turns against their old one carried by the maps.

        Args:
            moved: ``[n, 3]`` displacements.
            maps: ``[n, 3, 3]`` local linear maps of the edit.

        Returns:
            Their indices, in order.
        """
        motion = {axis: column for axis, column in enumerate(moved.T) if column.any()}
        rows = self._suspects(motion, wild(maps), 1.0, self._slender)
        corners = self._corners[:, rows]
        before = _sides(self._columns, corners)
        after = before.copy()
        for axis, column in motion.items():
            after[:, axis] += _differences(column, corners)
        a, b, c = (maps[corner] for corner in corners)
        mean = ((a + b + c) / 3).transpose(1, 2, 0)
        carried = cross(*((mean * side).sum(axis=1) for side in before))
        return rows[dot(carried, cross(*after)) < 0.0]

    @cached_property
    def _slender(self) -> Mask:
        """``[F]`` faces whose normals single precision knows hardly anything of."""
        squared = dot(self._sides[0], self._sides[0]) * dot(self._sides[1], self._sides[1])
        return np.asarray(self._room < TURNED * SLENDER**2 * squared)

    def _suspects(
        self, motion: Motion, wild: Mask, reach: float, others: Mask | None = None
    ) -> Index:
        """Faces that may fold in steps of up to `reach`, and ``[F]`` others."""
        columns = {axis: column.astype(np.float32, copy=False) for axis, column in motion.items()}
        found = np.zeros(self._corners.shape[1], bool)
        any_wild = bool(wild.any())
        for rows in self._blocks():
            corners, room = self._corners[:, rows], self._room[rows]
            changes = {axis: _differences(column, corners) for axis, column in columns.items()}
            if changes:
                found[rows] = _change(self._sides[:, :, rows], changes, reach) > room
            if any_wild:
                a, b, c = corners
                found[rows] |= (wild[a] | wild[b] | wild[c]) & (room < np.inf)
        return np.flatnonzero(found if others is None else found | others)

    def _blocks(self) -> list[slice]:
        count = self._corners.shape[1]
        return [slice(start, start + BLOCK) for start in range(0, count, BLOCK)]


def count_flips(before: Array, after: Array, faces: Index, maps: NDArray[np.floating]) -> int:
    """How many ``faces [F, 3]`` are flipped when vertices go from ``before`` to ``after [n, 3]``
    and turn by ``maps [n, 3, 3]``."""
    return len(Turning(before, faces).flipped(after - before, maps))


def _sides(columns: Array, corners: Index) -> Array:
    """``[2, 3, m]`` sides of faces with ``corners [3, m]`` among points ``columns [3, n]``."""
    sides = np.empty((2, 3, corners.shape[1]))
    for axis, column in enumerate(columns):
        sides[:, axis] = _differences(column, corners)
    return sides


def _differences(column: NDArray[Real], corners: Index) -> tuple[NDArray[Real], NDArray[Real]]:
    """``[m]`` from the first of ``corners [3, m]`` to either other, of values ``column [n]``."""
    first, second, third = (np.take(column, corner) for corner in corners)
    second -= first
    third -= first
    return second, third


def _change(
    sides: Array32, changes: Mapping[int, tuple[Array32, Array32]], reach: float
) -> Array32:
    """``[m]`` the squared most by which normals change in steps of up to `reach`."""
    e1, e2 = sides
    linear: dict[int, Array32] = {}
    for axis, (d1, d2) in changes.items():
        i, j = (axis + 1) % 3, (axis + 2) % 3
        for k, change in ((i, e1[j] * d2 - d1 * e2[j]), (j, d1 * e2[i] - e1[i] * d2)):
            linear[k] = linear[k] + change if k in linear else change
    most = np.square(linear[i])
    for k in linear.keys() - {i}:
        most += np.square(linear[k])
    if len(changes) > 1:
        # Along one axis changes are parallel, and their product is nothing.
        both = np.zeros_like(sides)
        for axis, pair in changes.items():
            both[:, axis] = pair
        quadratic = cross(*both)
        most = (np.sqrt(most) + np.float32(reach) * np.sqrt(dot(quadratic, quadratic))) ** 2
    return np.float32(reach**2) * most
