"""How much memory an object holds on to."""

from __future__ import annotations

import sys
from types import FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

SHARED = (type, ModuleType, FunctionType, MethodType)
"""What belongs to the program, whatever refers to it."""


def footprint(root: object, others: tuple[type, ...] = ()) -> int:
    """Bytes of everything that is reached from an object, each thing once.

    An array counts with all of the memory that it is a view of.

    Args:
        root: the object.
        others: classes of objects that are not its own, and all that is reached only from them.
    """
    known: set[int] = set()
    size, left = 0, [root]
    while left:
        item = left.pop()
        if id(item) in known or isinstance(item, (*SHARED, *others)):
            continue
        known.add(id(item))
        size += _own(item)
        left += _parts(item)
    return size


def _own(item: object) -> int:
    if isinstance(item, np.ndarray):
        return item.nbytes if item.base is None else 0
    return sys.getsizeof(item)


def _parts(item: object) -> list[Any]:
    if isinstance(item, np.ndarray):
        parts = [] if item.base is None else [item.base]
        return parts + item.ravel().tolist() if item.dtype.hasobject else parts
    if isinstance(item, memoryview):
        return [item.obj]
    if isinstance(item, str | bytes | bytearray | int | float):
        return []
    if isinstance(item, dict):
        return [*item.keys(), *item.values()]
    if isinstance(item, list | tuple | set | frozenset):
        return list(item)
    slots = [name for kind in type(item).__mro__ for name in getattr(kind, "__slots__", ())]
    own = [getattr(item, name) for name in slots if hasattr(item, name)]
    return [*own, *vars(item).values()] if hasattr(item, "__dict__") else own
