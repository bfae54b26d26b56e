"""What carries a nuisance parameter along when others are edited, as a T-tail goes with its fin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.template.expressions import ExpressionError, parse_affine, parse_rows

Array = NDArray[np.float64]

TINY = np.finfo(float).tiny


@dataclass(frozen=True)
class Guide:
    """Places that edits move, among which a parameter keeps its own.

    Attributes:
        place: ``[1 + d]`` affine row of what is looked for among the places.
        between: ``[k, 1 + d]`` rows of the places, in ascending order on any shape.
        moves: ``[k, 1 + d]`` rows of what the parameter follows where it is at each of them;
            between two it follows both, in proportion, and beyond the last the last.
    """

    place: Array
    between: Array
    moves: Array

    @property
    def leaders(self) -> NDArray[np.bool_]:
        """``[d]`` the parameters that it may follow."""
        return np.asarray(self.moves[:, 1:].any(axis=0))

    def row(self, f: Array) -> Array:
        """``[d]`` changes of the parameter for a unit of each, from ``f [d]`` on."""
        at = np.concatenate([[1.0], f])
        place, knots = self.place @ at, self.between @ at
        share = np.zeros(len(knots))
        above = int(np.clip(np.searchsorted(knots, place), 1, len(knots) - 1))
        low, high = knots[above - 1], knots[above]
        share[above] = np.clip((place - low) / max(high - low, TINY), 0.0, 1.0)
        share[above - 1] = 1.0 - share[above]
        row: Array = share @ self.moves
        return row[1:]


def read_guide(
    name: str, entry: str | Mapping[str, Any], names: Sequence[str], public: Sequence[bool]
) -> Guide:
    """Compile what a parameter `follows` in a template file.

    Args:
        name: of the parameter.
        entry: a parameter that it keeps in proportion to, or expressions: `between` the places,
            `at` its own (by default its value) and `moves` at each (by default those places).
        names: of all ``d`` parameters.
        public: which of them are offered to users.

    Raises:
        ExpressionError: for what is not affine, or names what may not lead.
    """
    if isinstance(entry, str):
        entry = {"between": [f"-1 * {entry}", entry]}
    unknown = set(entry) - {"between", "at", "moves"}
    if unknown or "between" not in entry:
        raise ExpressionError(
            "it is to be a name, or have `between`, and may have `at` and `moves`"
        )
    between = parse_rows(entry["between"], names)
    moves = parse_rows(entry.get("moves", entry["between"]), names)
    if len(between) < 2 or len(moves) != len(between):
        raise ExpressionError("there are to be two places or more, and a move for each")
    if moves[:, 1:][:, ~np.array(public)].any():
        raise ExpressionError("only public parameters lead")
    return Guide(parse_affine(entry.get("at", name), names), between, moves)
