"""From what parts say of a mesh's vertices to its binding.

Few entries of the parts' maps change with a parameter, and few of those with the same: that is
why displacements are added up entry by entry, each for a block of vertices at a time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.deform.binding import Binding, part_stretches
from service.deform.groups import Group
from service.deform.loft import Loft
from service.deform.proximity import Array32, Boxes
from service.deform.weld import Welded
from service.template.affine import AffineTemplate

Field = dict[int, Array32]
"""``[n]`` displacements per unit of a parameter, by coordinate and parameter as one index into
``[3, d]``; those that are left out are zero."""


@dataclass(frozen=True)
class Moves:
    """How the coefficients of the parts' maps change a unit of each parameter.

    Attributes:
        run: ``[P]`` the axis that each part runs along.
        entries: by part and coefficient, the changes by index into ``[3, d]``.  The coefficients
            stand by ``u`` and 1, of the frame, and by ``u[run] u``, of the taper.
    """

    run: NDArray[np.int64]
    entries: Sequence[dict[int, list[tuple[int, np.float32]]]]

    @classmethod
    def of(cls, template: AffineTemplate) -> Moves:
        """Of all parts of a template."""
        changes = np.concatenate([template.frame_jacobian, template.taper_jacobian], axis=2)
        count = changes.shape[3]
        entries: list[dict[int, list[tuple[int, np.float32]]]] = []
        for part in changes.astype(np.float32):
            entries.append({})
            for axis, k, parameter in np.argwhere(part).tolist():
                change = part[axis, k, parameter]
                entries[-1].setdefault(k, []).append((axis * count + parameter, change))
        return cls(template.run, entries)

    def fields(self, groups: Sequence[Group], shares: Array32, local: Array32) -> list[Field]:
        """Displacements as each group alone has them.

        Args:
            groups: of the parts.
            shares: ``[n, P]`` of the parts in their groups.
            local: ``[n, P, 3]`` where each part carries the vertices.
        """
        fields: list[Field] = []
        for group in groups:
            field: Field = {}
            for part in group.members:
                for k, changes in self.entries[part].items():
                    coefficient = self._coefficient(local[:, part], part, k)
                    if len(group.members) > 1:
                        coefficient = coefficient * shares[:, part]
                    for index, change in changes:
                        moved = change * coefficient
                        field[index] = field[index] + moved if index in field else moved
            fields.append(field)
        return fields

    def _coefficient(self, u: Array32, part: int, k: int) -> Array32:
        """``[n]`` what a coefficient stands by at ``u [n, 3]``."""
        if k < 3:
            return u[:, k]
        if k == 3:
            return np.ones(len(u), np.float32)
        coefficient: Array32 = np.clip(u[:, self.run[part]], -0.5, 0.5) * u[:, k - 4]
        return coefficient


class Compiler:
    """A binding in the making."""

    def __init__(
        self, template: AffineTemplate, boxes: Boxes, groups: Sequence[Group], count: int
    ) -> None:
        """
        Args:
            template: whose parts the mesh follows.
            boxes: the parts at the bound parameters.
            groups: of the parts.
            count: of the mesh's vertices.
        """
        self._boxes, self._groups = boxes, groups
        stretches = part_stretches(template, boxes.inverses)
        self._stretches, self._ways = [], dict[int, slice]()
        ways = 0
        for part, straight in enumerate(stretches.reshape(-1, 3, *stretches.shape[1:])):
            loft = boxes.lofts.get(part)
            tapered = loft is not None and loft.tapered
            own = _taper_stretches(template, part, loft) if loft and tapered else straight
            self._ways[part] = slice(ways, ways + len(own))
            self._stretches.append(own)
            ways += len(own)
        # What nothing is added to takes no memory.
        self._jacobian = np.zeros((3 * len(template.names), count), np.float32)
        self._gains = np.zeros((ways, count), np.float32)

    def add(
        self,
        rows: slice,
        fields: Sequence[Field],
        shares: Array32,
        near: Array32,
        local: Array32,
        gains: Array32,
    ) -> None:
        """Bind some vertices.

        Args:
            rows: which.
            fields: displacements by each group.
            shares: ``[n, P]`` of the parts in their groups.
            near: ``[n, G]`` of the groups, one in sum.
            local: ``[n, P, 3]`` where each part carries the vertices, in its unit frame.
            gains: ``[n, P, 3]`` derivative of `local` along the part's axes; 1 inside, 0 far
                outside.
        """
        for g, (group, field) in enumerate(zip(self._groups, fields, strict=True)):
            share = near[:, g]
            if not share.any():
                continue
            for index, moved in field.items():
                self._jacobian[index, rows] += share * moved
            for part in group.members:
                own = share * shares[:, part] if len(group.members) > 1 else share
                into = self._gains[self._ways[part], rows]
                loft = self._boxes.lofts.get(part)
                if loft is not None and loft.tapered:
                    _taper_gains(loft, local[:, part].T, gains[:, part].T * own, into)
                else:
                    np.multiply(gains[:, part].T, own, out=into)

    def binding(self, welded: Welded) -> Binding:
        """Of the mesh itself, whose vertices were those of the welded one."""
        jacobian, gains = (_expanded(rows, welded) for rows in (self._jacobian, self._gains))
        return Binding(
            jacobian=jacobian.reshape(3, -1, jacobian.shape[1]).transpose(2, 0, 1),
            gains=gains.T,
            stretches=np.concatenate(self._stretches),
            welded=welded,
        )


def _expanded(rows: Array32, welded: Welded) -> Array32:
    """``[k, V]`` of the mesh's vertices from ``[k, n]`` of the welded one's."""
    if welded.seamless:
        return rows
    expanded = np.zeros((len(rows), len(welded.of)), np.float32)
    for row, whole in zip(rows, expanded, strict=True):
        if row.any():
            np.take(row, welded.of, out=whole, mode="clip")
    return expanded


def _taper_gains(loft: Loft, local: Array32, gains: Array32, into: Array32) -> None:
    """Write how far vertices follow a tapering part to ``into [9, n]``; the ways are
    `_taper_stretches`'s.

    With ``s`` along the run of length L, a size z across it and its taper t, the unit coordinate
    is ``u = (x - s lean) / (z + s t)``, so that its slope has a component along the run too.

    Args:
        local, gains: ``[3, n]``.
    """
    run, across = loft.run, loft.across
    s = np.clip(local[run], -0.5, 0.5)
    inside = np.abs(local[run]) <= 0.5
    length = np.float32(loft.length)
    into[0] = gains[run] / length
    sections, lean = loft.section(s), loft.lean
    for a, axis in enumerate(across):
        beside = inside * local[axis]
        leaning = (lean[a] + np.float32(loft.taper[axis]) * beside) / length
        upright = gains[axis] / sections[a]
        sheared = -leaning * upright
        into[1 + a] = upright
        into[3 + a] = sheared
        into[5 + a] = s * upright
        into[7 + a] = into[0] * beside + s * sheared


def _taper_stretches(template: AffineTemplate, part: int, loft: Loft) -> NDArray[np.float32]:
    """``[9, 9, d]`` changes of a tapering part's map: along its run, then of both sizes and of both
    tapers across it, each along its own axis and along the run."""
    run, across = loft.run, loft.across
    frame, taper = template.frame_jacobian[part], template.taper_jacobian[part]
    ways = [(frame[:, run], run)]
    for change in (frame, taper):
        ways += [(change[:, axis], axis) for axis in across]
        ways += [(change[:, axis], run) for axis in across]
    axes = np.eye(3)
    maps = [np.einsum("id,j->ijd", change, axes[axis]) for change, axis in ways]
    return np.stack(maps).reshape(len(maps), 9, -1).astype(np.float32)
