"""Numbers of a text file replaced by others; every other byte stays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.mesh.polygons import Indices

# Numbers that differ by more than this part of themselves differ in nine digits.
CLOSE = 1e-8
# Tokens rewritten together: as Python objects they take ten times their room.
BLOCK = 1 << 16


def printed(value: float) -> bytes:
    """A number as these formats write it: nine significant digits hold any float32."""
    return b"%.9g" % (value + 0.0)


@dataclass(frozen=True)
class Replacement:
    """Tokens of a file to be replaced by numbers.

    Attributes:
        starts, ends: ``[N]`` their spans in the file.
        old: ``[N]`` the numbers that are there; one that prints as before keeps its bytes.
        new: ``[N]`` the numbers to write.
    """

    starts: Indices
    ends: Indices
    old: NDArray[np.float64]
    new: NDArray[np.float64]


def rewrite(data: bytes, replacements: list[Replacement]) -> bytes:
    """`data` with other numbers in place of some tokens, no two of them the same."""
    starts, ends, old, new = (
        np.concatenate([getattr(replacement, name) for replacement in replacements])
        for name in ("starts", "ends", "old", "new")
    )
    order = np.argsort(starts, kind="stable")
    order = order[old[order] != new[order]]
    # Only numbers this close can print alike.
    close = np.abs(new - old) <= CLOSE * np.abs(new)
    pieces: list[bytes] = []
    done = 0
    for first in range(0, len(order), BLOCK):
        part = order[first : first + BLOCK]
        columns = [column[part].tolist() for column in (starts, ends, old, new, close)]
        fresh: list[bytes] = []
        for start, end, before, after, alike in zip(*columns, strict=True):
            text = printed(after)
            if not alike or text != printed(before):
                fresh += (data[done:start], text)
                done = end
        pieces.append(b"".join(fresh))
    return b"".join([*pieces, data[done:]]) if done else data
