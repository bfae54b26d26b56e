"""Reads the arrays of a pickled body without running anything that the pickle asks for.

Bodies in SMPL's format are often pickles, many of Python 2 and of chumpy's lazy arrays.  Unpickling
runs whatever a file names, so each name is met by an inert stand-in that only keeps what it is
given; arrays are rebuilt from the stand-ins afterwards.  Any other name is refused.
"""

from __future__ import annotations

import io
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

_NUMERIC = "fiub"
_HARMLESS: dict[str, Callable[..., Any]] = {"set": set, "frozenset": frozenset, "object": object}
_ARRAYS = {"numpy.core.multiarray", "numpy._core.multiarray"}
_BUFFERS = {"numpy.core.numeric", "numpy._core.numeric"}
_SPARSE = {"csc_matrix", "csr_matrix", "csc_array", "csr_array"}


class ForbiddenPickle(ValueError):
    """A pickle that names something other than an array, or that is broken."""


def read_pickle(data: bytes) -> dict[str, Any]:
    """The pickled dictionary, its arrays as stand-ins that `to_array` turns into arrays.

    Raises:
        ForbiddenPickle: when it names anything but arrays, is broken or holds no dictionary.
    """
    try:
        content = _Unpickler(io.BytesIO(data), encoding="latin1").load()
    except ForbiddenPickle:
        raise
    except Exception as error:
        # A broken pickle can raise nearly anything: its opcodes are a program.
        raise ForbiddenPickle(f"the pickle is broken: {type(error).__name__}") from error
    if not isinstance(content, dict):
        raise ForbiddenPickle(f"the pickle holds a {type(content).__name__}, not a dictionary")
    return {str(name): value for name, value in content.items()}


def to_array(value: Any) -> NDArray[Any] | scipy.sparse.sparray:
    """A numpy array or a scipy sparse array of what `read_pickle` gave.

    Raises:
        ValueError: for an object array or anything that is no array; says what it is.
    """
    if isinstance(value, _Array):
        return value.rebuilt()
    if isinstance(value, _Sparse):
        return value.rebuilt()
    if isinstance(value, _Chumpy):
        return value.evaluated()
    array = np.asarray(value)
    if array.dtype.kind not in _NUMERIC + "U":
        raise ValueError(f"is a {type(value).__name__}, not an array")
    return array


class _Kept:
    """A stand-in: keeps its constructor's arguments and its state.

    It is `__setstate__` that keeps a pickle from setting attributes of the class itself.
    """

    def __init__(self, *arguments: Any) -> None:
        self.arguments = arguments
        self.state: Any = None

    def __setstate__(self, state: Any) -> None:
        self.state = state


class _Dtype(_Kept):
    """Stands for `numpy.dtype`."""

    def rebuilt(self) -> np.dtype[Any]:
        code = str(self.arguments[0])
        if code[:1] == "O":
            raise ValueError("is an object array, not one of numbers; save it as a plain array")
        dtype = np.dtype(code)
        if dtype.kind not in _NUMERIC:
            raise ValueError(f"is an array of {code}, not of numbers")
        swapped = self.state is not None and self.state[1] == ">"
        return dtype.newbyteorder(">" if swapped else "<")


class _Array(_Kept):
    """Stands for `numpy.ndarray`; its state is (version, shape, dtype, Fortran order, bytes)."""

    def rebuilt(self) -> NDArray[Any]:
        if not isinstance(self.state, tuple) or len(self.state) < 4:
            raise ValueError("is an array without contents")
        shape, dtype, fortran, raw = self.state[-4:]
        if not isinstance(dtype, _Dtype):
            raise ValueError("is an array without a type")
        # Python 2 has its bytes in a str, which arrives as text in Latin-1.
        raw = raw.encode("latin1") if isinstance(raw, str) else raw
        kind = dtype.rebuilt()
        return np.frombuffer(raw, kind).reshape(shape, order="F" if fortran else "C")


class _Sparse(_Kept):
    """Stands for scipy's compressed matrices, whose state is a dictionary of their attributes."""

    columns = True

    def rebuilt(self) -> scipy.sparse.sparray:
        state = self.state
        parts = tuple(to_array(state[name]) for name in ("data", "indices", "indptr"))
        shape = tuple(int(extent) for extent in state["_shape" if "_shape" in state else "shape"])
        make = scipy.sparse.csc_array if self.columns else scipy.sparse.csr_array
        matrix = make(parts, shape=shape)
        # By default indices go unchecked, and ones out of range are read all the same.
        matrix.check_format(full_check=True)
        return matrix


class _SparseRows(_Sparse):
    columns = False


class _Chumpy(_Kept):
    """Stands for chumpy's lazy arrays: plain ones, and selections from them."""

    kind = ""

    def evaluated(self) -> NDArray[Any]:
        state = self.state if isinstance(self.state, dict) else {}
        if self.kind == "Select" and "a" in state and "idxs" in state:
            chosen = np.asarray(to_array(state["a"])).ravel()[np.asarray(to_array(state["idxs"]))]
            return chosen.reshape(state.get("preferred_shape", chosen.shape))
        if self.kind == "Ch" and "x" in state:
            return np.asarray(to_array(state["x"]))
        raise ValueError(f"is an expression of chumpy ({self.kind}); save it as a plain array")


def _made(kind: Any, *_: Any) -> Any:
    """What `copyreg._reconstructor` is met by: an empty stand-in."""
    if not (isinstance(kind, type) and issubclass(kind, _Kept)):
        raise ForbiddenPickle("the pickle rebuilds something other than an array")
    return kind()


def _array_of(buffer: Any, dtype: Any, shape: Any, order: Any) -> _Array:
    """What numpy's `_frombuffer` is met by, which protocol 5 has."""
    array = _Array()
    array.state = (shape, dtype, order == "F", buffer)
    return array


def _encoded(text: str, encoding: str = "latin1") -> bytes:
    """What `codecs.encode` is met by: Python 3 writes bytes so for older protocols."""
    if encoding not in ("latin1", "latin-1"):
        raise ForbiddenPickle(f"the pickle encodes text as {encoding!r}")
    return text.encode("latin1")


class _Unpickler(pickle.Unpickler):
    """Knows arrays and chumpy's objects by their stand-ins, and nothing else."""

    def find_class(self, module: str, name: str) -> Any:
        """The stand-in of a name.

        Raises:
            ForbiddenPickle: when it has none.
        """
        if module in _ARRAYS and name in ("_reconstruct", "scalar"):
            # Functions are made anew: a pickle may set attributes of what it gets.
            return lambda *arguments: _Array(*arguments)
        if module in _BUFFERS and name == "_frombuffer":
            return lambda *arguments: _array_of(*arguments)
        if module == "numpy" and name in ("ndarray", "dtype"):
            return _Array if name == "ndarray" else _Dtype
        if module.startswith("scipy.sparse") and name in _SPARSE:
            return _Sparse if name.startswith("csc") else _SparseRows
        if module.split(".")[0] == "chumpy":
            return type(name, (_Chumpy,), {"kind": name})
        if module in ("builtins", "__builtin__") and name in _HARMLESS:
            return _HARMLESS[name]
        if module in ("copyreg", "copy_reg") and name == "_reconstructor":
            return lambda *arguments: _made(*arguments)
        if module == "_codecs" and name == "encode":
            return lambda *arguments: _encoded(*arguments)
        raise ForbiddenPickle(f"the pickle names {module}.{name}, which is no array")

    def persistent_load(self, pid: Any) -> Any:
        """Refused: bodies have none."""
        raise ForbiddenPickle("the pickle refers to data outside itself")
