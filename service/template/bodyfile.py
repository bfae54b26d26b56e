"""Body files in SMPL's format: ``.npz`` or ``.pkl`` in, a checked `SkinnedTemplate` out.

The fields are those of Loper et al., SMPL: A Skinned Multi-Person Linear Model (2015), which the
paper's humans are (section 5): ``v_template``, ``shapedirs``, ``posedirs``, ``J_regressor``,
``weights``, ``kintree_table`` and ``f``.
"""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from service.template.anatomy import JOINTS, PARENTS
from service.template.bodypickle import read_pickle, to_array
from service.template.skinned import SHAPES, SkinnedTemplate

Array = NDArray[np.float64]

LARGEST = 400 * 1024 * 1024
"""Most bytes of a file, and of the fields that are read once they are unpacked."""
POSE_FEATURES = 9 * (len(JOINTS) - 1)
"""Entries of all rotations but the root's, which pose correctives are linear in."""
POINTS = 2048
_FIELDS = (
    "v_template", "shapedirs", "posedirs", "J_regressor", "weights", "lbs_weights",
    "kintree_table", "f", "shape_names",
)  # fmt: skip
_OTHERS = {5: "FLAME's head", 16: "a MANO hand", 52: "SMPL-H", 55: "SMPL-X"}
_HAVE_SMPL = "Use a body with SMPL's 24 joints, such as SMPL's own."


class BodyFileError(ValueError):
    """A body file that can't be used; the message names the field, and says what to do."""


def load_body(source: Path | None = None) -> SkinnedTemplate:
    """Read and check a body.

    Args:
        source: an ``.npz`` file, or a pickle (``.pkl``), of which only arrays are read and nothing
            is run; None is the body that is shipped.  It is in metres, in a T-pose, +Y up and +Z to
            the front.

    Raises:
        BodyFileError: when it is missing, too large or broken, when a field is missing or has the
            wrong form, or when its joints aren't SMPL's.
    """
    data = _shipped() if source is None else _bytes(source)
    fields = _read_npz(data) if data[:2] == b"PK" else _read_pickle(data)
    digest = f"sha256-{hashlib.sha256(data).hexdigest()}"
    return build_body(fields, digest)


def build_body(fields: Mapping[str, Any], digest: str) -> SkinnedTemplate:
    """A template from the fields of a file; see `load_body`."""
    _require_tree(fields)
    rest = _numbers(fields, "v_template", (None, 3))
    count, joints = len(rest), len(JOINTS)
    dirs = _numbers(fields, "shapedirs", (count, 3, None))
    if dirs.shape[2] < SHAPES:
        raise BodyFileError(f"shapedirs: {dirs.shape[2]} directions; {SHAPES} are needed")
    dirs = dirs[:, :, :SHAPES]
    regressor = _numbers(fields, "J_regressor", (joints, count))
    return SkinnedTemplate(
        name="human",
        label="Human body",
        points=POINTS,
        rest=rest,
        shapedirs=np.ascontiguousarray(dirs),
        joints=regressor @ rest,
        joint_dirs=np.einsum("jv,vcs->jcs", regressor, dirs),
        weights=_weights(fields, count),
        posedirs=_correctives(fields, count),
        faces=_faces(fields, count),
        shape_labels=_labels(fields),
        digest=digest,
    )


def _shipped() -> bytes:
    file = resources.files("service.template") / "human.npz"
    if not file.is_file():
        raise BodyFileError("no body is shipped with this installation; name a file of your own")
    return file.read_bytes()


def _bytes(source: Path) -> bytes:
    """The file, once its size is known to be fit to read."""
    try:
        size = source.stat().st_size
        if size > LARGEST:
            raise BodyFileError(f"{source.name} has {size} bytes; at most {LARGEST} are read")
        return source.read_bytes()
    except OSError as error:
        raise BodyFileError(f"{source.name} can't be read: {error.strerror}") from error


def _read_npz(data: bytes) -> dict[str, Any]:
    """The fields of an archive of arrays; object arrays, which are pickles, are refused."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            wanted = {f"{name}.npy" for name in _FIELDS}
            size = sum(i.file_size for i in archive.infolist() if i.filename in wanted)
        if size > LARGEST:
            raise BodyFileError(f"the arrays unpack to {size} bytes; at most {LARGEST} are read")
        arrays = np.load(io.BytesIO(data), allow_pickle=False)
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        if isinstance(error, BodyFileError):
            raise
        raise BodyFileError(f"the file is no archive of arrays: {error}") from error
    fields = {}
    for name in _FIELDS:
        if name in arrays:
            try:
                fields[name] = arrays[name]
            except Exception as error:
                reason = "Object arrays cannot" in str(error)
                what = "is an object array, not one of numbers" if reason else f"({error})"
                raise BodyFileError(f"{name}: {what}; save it as a plain, dense array") from error
    return fields


def _read_pickle(data: bytes) -> dict[str, Any]:
    try:
        return {name: value for name, value in read_pickle(data).items() if name in _FIELDS}
    except ValueError as error:
        raise BodyFileError(f"{error}; a body is an .npz or a pickle of arrays") from error


def _array(fields: Mapping[str, Any], name: str) -> Any:
    """A field as a numpy or a scipy sparse array."""
    if name not in fields:
        raise BodyFileError(f"{name}: the field is missing; a body in SMPL's format has it")
    try:
        return to_array(fields[name])
    except Exception as error:
        # What a stand-in was given can be anything, a stand-in that holds itself included.
        raise BodyFileError(f"{name}: {error}") from error


def _numbers(fields: Mapping[str, Any], name: str, shape: tuple[int | None, ...]) -> Array:
    """A field of finite numbers of a shape, where None is any extent but 0."""
    array = _array(fields, name)
    fits = len(array.shape) == len(shape) and all(
        have == want if want is not None else have > 0
        for have, want in zip(array.shape, shape, strict=True)
    )
    if not fits:
        wanted = ", ".join("any" if extent is None else str(extent) for extent in shape)
        raise BodyFileError(f"{name}: its shape is {list(array.shape)}, not [{wanted}]")
    # Only now: a sparse array could be of any extent.
    dense = array.toarray() if scipy.sparse.issparse(array) else array
    if dense.dtype.kind not in "fiu":
        raise BodyFileError(f"{name}: it holds {dense.dtype}, not numbers")
    if not np.isfinite(dense).all():
        raise BodyFileError(f"{name}: some of its numbers are not finite")
    return np.ascontiguousarray(dense, dtype=np.float64)


def _require_tree(fields: Mapping[str, Any]) -> None:
    """The joints must be SMPL's: the parameters' names and limits are."""
    table = _array(fields, "kintree_table")
    if table.ndim != 2 or len(table) != 2 or table.dtype.kind not in "iuf":
        raise BodyFileError(f"kintree_table: its shape is {list(table.shape)}, not [2, 24]")
    count = table.shape[1]
    if count != len(JOINTS):
        known = f", like {_OTHERS[count]}" if count in _OTHERS else ""
        raise BodyFileError(f"kintree_table: it has {count} joints{known}, not 24. {_HAVE_SMPL}")
    # The root's parent is -1, or what that is as an unsigned number.
    parents = tuple(int(p) if 0 <= p < count else -1 for p in table[0].tolist())
    if parents != PARENTS or table[1].tolist() != list(range(count)):
        raise BodyFileError(
            f"kintree_table: its joints make another tree than SMPL's. {_HAVE_SMPL}"
        )


def _weights(fields: Mapping[str, Any], count: int) -> Array:
    name = "weights" if "weights" in fields else "lbs_weights"
    if name not in fields:
        raise BodyFileError("weights: the field is missing; a body in SMPL's format has it")
    weights = _numbers(fields, name, (count, len(JOINTS)))
    sums = weights.sum(axis=1, keepdims=True)
    if np.abs(sums - 1.0).max() > 1e-3 or weights.min() < -1e-6:
        raise BodyFileError(f"{name}: each vertex's must be positive and sum to 1")
    return weights / sums


def _correctives(fields: Mapping[str, Any], count: int) -> Array:
    """Pose correctives ``[V, 3, 207]``, or ``[V, 3, 0]`` without any."""
    if "posedirs" not in fields:
        return np.zeros((count, 3, 0))
    shape = _array(fields, "posedirs").shape
    if shape == (count, 3, 0):
        return np.zeros(shape)
    return _numbers(fields, "posedirs", (count, 3, POSE_FEATURES))


def _faces(fields: Mapping[str, Any], count: int) -> NDArray[np.int64]:
    faces = _numbers(fields, "f", (None, 3))
    if (faces != np.floor(faces)).any() or faces.min() < 0 or faces.max() >= count:
        raise BodyFileError(f"f: its entries must be whole, from 0 to {count - 1}")
    return faces.astype(np.int64)


def _labels(fields: Mapping[str, Any]) -> tuple[str, ...]:
    """What the coefficients read as; SMPL's own, which are principal components, have no names."""
    if "shape_names" not in fields:
        return tuple(f"Shape component {index + 1}" for index in range(SHAPES))
    names = _array(fields, "shape_names")
    if names.ndim != 1 or names.dtype.kind != "U" or len(names) < SHAPES:
        raise BodyFileError(f"shape_names: it must hold at least {SHAPES} texts")
    return tuple(str(name) for name in names[:SHAPES])
