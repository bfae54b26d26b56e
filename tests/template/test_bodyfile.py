from __future__ import annotations

import hashlib
import io
import os
import pickle
import sys
import types
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse

from service.template import bodyfile
from service.template.anatomy import PARENTS
from service.template.bodyfile import BodyFileError, load_body
from service.template.skinned import SkinnedTemplate

Fields = dict[str, Any]
COUNT = 60


@pytest.fixture
def fields() -> Fields:
    """A body of random numbers in SMPL's format."""
    rng = np.random.default_rng(0)
    weights = rng.random((COUNT, 24))
    regressor = rng.random((24, COUNT))
    root = np.iinfo(np.uint32).max
    return {
        "v_template": rng.normal(size=(COUNT, 3)),
        "shapedirs": rng.normal(size=(COUNT, 3, 10)),
        "posedirs": rng.normal(size=(COUNT, 3, 207)),
        "J_regressor": regressor / regressor.sum(axis=1, keepdims=True),
        "weights": weights / weights.sum(axis=1, keepdims=True),
        "kintree_table": np.array([[root, *PARENTS[1:]], range(24)], dtype=np.uint32),
        "f": rng.integers(0, COUNT, (100, 3)).astype(np.uint32),
    }


def write_npz(path: Path, fields: Fields) -> Path:
    np.savez(path, **fields)
    return path


def write_pickle(path: Path, fields: Any, protocol: int = 2) -> Path:
    path.write_bytes(pickle.dumps(fields, protocol=protocol))
    return path


def assert_holds(body: SkinnedTemplate, fields: Fields) -> None:
    assert np.array_equal(body.rest, fields["v_template"])
    assert np.array_equal(body.shapedirs, fields["shapedirs"][:, :, :3])
    assert np.array_equal(body.posedirs, fields["posedirs"])
    assert np.allclose(body.weights, fields["weights"], atol=1e-12)
    assert np.array_equal(body.faces, fields["f"])
    assert np.allclose(body.joints, fields["J_regressor"] @ fields["v_template"], atol=1e-12)
    moved = fields["v_template"] + fields["shapedirs"][:, :, 1]
    expected = fields["J_regressor"] @ moved
    assert np.allclose(body.joints + body.joint_dirs[:, :, 1], expected, atol=1e-12)


def test_an_npz_is_read_as_it_was_written(tmp_path: Path, fields: Fields) -> None:
    path = write_npz(tmp_path / "body.npz", fields)
    body = load_body(path)
    assert_holds(body, fields)
    assert (body.name, body.label, body.points) == ("human", "Human body", 2048)
    assert body.digest == f"sha256-{hashlib.sha256(path.read_bytes()).hexdigest()}"
    assert len(body.shape_labels) == 3
    assert body.faces.dtype == np.int64
    assert all(array.dtype == np.float64 for array in (body.rest, body.weights, body.posedirs))


def test_names_correctives_and_a_signed_root_are_optional(tmp_path: Path, fields: Fields) -> None:
    fields["shape_names"] = np.array(["height", "weight", "build"])
    fields["lbs_weights"] = fields.pop("weights").astype(np.float32)
    fields["kintree_table"] = np.array([PARENTS, range(24)])
    del fields["posedirs"]
    body = load_body(write_npz(tmp_path / "body.npz", fields))
    assert body.shape_labels == ("height", "weight", "build")
    assert body.posedirs.shape == (COUNT, 3, 0)
    fields["posedirs"] = np.zeros((COUNT, 3, 0))
    body = load_body(write_npz(tmp_path / "body.npz", fields))
    assert body.posedirs.shape == (COUNT, 3, 0)
    assert np.allclose(body.weights.sum(axis=1), 1.0, atol=1e-12)


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_pickles_of_every_protocol_are_read(tmp_path: Path, fields: Fields, protocol: int) -> None:
    fields["v_template"] = np.asfortranarray(fields["v_template"])
    assert_holds(load_body(write_pickle(tmp_path / "body.pkl", fields, protocol)), fields)


@pytest.mark.parametrize("make", [scipy.sparse.csc_matrix, scipy.sparse.csr_matrix])
def test_a_sparse_regressor_is_read(tmp_path: Path, fields: Fields, make: Any) -> None:
    dense = fields["J_regressor"]
    path = write_pickle(tmp_path / "body.pkl", fields | {"J_regressor": make(dense)})
    assert_holds(load_body(path), fields)


def test_an_older_sparse_matrix_names_other_modules(tmp_path: Path, fields: Fields) -> None:
    dense = fields["J_regressor"]
    path = write_pickle(
        tmp_path / "b.pkl", fields | {"J_regressor": scipy.sparse.csc_matrix(dense)}
    )
    data = path.read_bytes()
    assert b"scipy.sparse._csc" in data
    path.write_bytes(data.replace(b"scipy.sparse._csc", b"scipy.sparse.csc"))
    assert_holds(load_body(path), fields)


def test_sparse_indices_out_of_range_are_refused(tmp_path: Path, fields: Fields) -> None:
    matrix = scipy.sparse.csc_matrix(fields["J_regressor"])
    matrix.indices[5] = 10**6
    path = write_pickle(tmp_path / "body.pkl", fields | {"J_regressor": matrix})
    with pytest.raises(BodyFileError, match="J_regressor"):
        load_body(path)


@pytest.fixture
def chumpy(monkeypatch: pytest.MonkeyPatch) -> types.SimpleNamespace:
    """Modules with chumpy's names, to write pickles with; gone again when one is read."""
    made = {}
    for module, name in (("chumpy.ch", "Ch"), ("chumpy.reordering", "Select")):
        made[name] = type(name, (), {"__module__": module})
        stand_in = types.ModuleType(module)
        setattr(stand_in, name, made[name])
        monkeypatch.setitem(sys.modules, module, stand_in)
    monkeypatch.setitem(sys.modules, "chumpy", types.ModuleType("chumpy"))
    return types.SimpleNamespace(**made)


def lazy(kind: type, **state: Any) -> Any:
    value = kind()
    value.__dict__.update(state)
    return value


@pytest.mark.parametrize("protocol", [0, 2])
def test_chumpys_arrays_are_read_without_chumpy(
    tmp_path: Path, fields: Fields, chumpy: types.SimpleNamespace, protocol: int
) -> None:
    wide = np.concatenate([fields["shapedirs"], np.ones((COUNT, 3, 4))], axis=2)
    chosen = np.arange(wide.size).reshape(wide.shape)[:, :, :10]
    content = fields | {
        "v_template": lazy(chumpy.Ch, x=fields["v_template"], _dirty_vars={"x"}, _cache={}),
        "shapedirs": lazy(
            chumpy.Select,
            a=lazy(chumpy.Ch, x=wide),
            idxs=chosen.ravel(),
            preferred_shape=chosen.shape,
        ),
        "J": lazy(chumpy.Select, whatever=1),
        "bs_type": "lrotmin",
    }
    path = write_pickle(tmp_path / "body.pkl", content, protocol)
    assert b"chumpy" in path.read_bytes()
    assert_holds(load_body(path), fields)


def test_an_expression_of_chumpy_is_refused(
    tmp_path: Path, fields: Fields, chumpy: types.SimpleNamespace
) -> None:
    own = lazy(chumpy.Select, idxs=np.arange(3))
    own.a = own
    for value in (own, lazy(chumpy.Ch, b=fields["v_template"])):
        path = write_pickle(tmp_path / "body.pkl", fields | {"v_template": value})
        with pytest.raises(BodyFileError, match="v_template"):
            load_body(path)


def test_a_python_2_pickle_is_read(tmp_path: Path, fields: Fields) -> None:
    """Python 2 writes an array's bytes as a str: opcode T, in Latin-1."""

    def save_bytes(pickler: Any, data: bytes) -> None:
        pickler.write(b"T" + len(data).to_bytes(4, "little") + data)

    pure: Any = pickle._Pickler
    old = type("Old", (pure,), {"dispatch": pure.dispatch | {bytes: save_bytes}})
    file = io.BytesIO()
    old(file, protocol=2).dump(fields)
    data = file.getvalue().replace(b"numpy._core", b"numpy.core")
    assert b"_codecs" not in data
    (tmp_path / "body.pkl").write_bytes(data)
    assert_holds(load_body(tmp_path / "body.pkl"), fields)


class Malicious:
    def __init__(self, call: Any, *arguments: Any) -> None:
        self.call = call, arguments

    def __reduce__(self) -> Any:
        return self.call


def test_a_pickle_is_never_run(tmp_path: Path, fields: Fields) -> None:
    trace = tmp_path / "trace"
    for call in (
        Malicious(os.system, f"touch {trace}"),
        Malicious(eval, f"open({str(trace)!r}, 'w')"),
        Malicious(getattr, "text", "upper"),
        Malicious(np.load, str(trace), None, True),
        Malicious(np.lib.npyio.DataSource, str(trace)),
    ):
        for content in (call, fields | {"extra": call}, fields | {"v_template": call}):
            path = write_pickle(tmp_path / "body.pkl", content)
            with pytest.raises(BodyFileError, match=r"names .*no array"):
                load_body(path)
    assert not trace.exists()


def test_a_pickle_cannot_change_the_reader(tmp_path: Path, fields: Fields) -> None:
    """BUILD on a class would set its attributes."""
    attack = b"\x80\x02cnumpy\nndarray\nN}X\x07\x00\x00\x00rebuiltK\x01s\x86b."
    (tmp_path / "attack.pkl").write_bytes(attack)
    with pytest.raises(BodyFileError, match="broken"):
        load_body(tmp_path / "attack.pkl")
    assert_holds(load_body(write_pickle(tmp_path / "body.pkl", fields)), fields)


@pytest.mark.parametrize("data", [b"", b"hello", b"PK\x03\x04 no archive", b"\x80\x02K\x01."])
def test_other_files_are_refused(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "body.npz"
    path.write_bytes(data)
    with pytest.raises(BodyFileError):
        load_body(path)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(BodyFileError, match=r"nobody\.npz can't be read"):
        load_body(tmp_path / "nobody.npz")


def test_large_files_are_not_read(
    tmp_path: Path, fields: Fields, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_npz(tmp_path / "body.npz", fields)
    packed = tmp_path / "packed.npz"
    np.savez_compressed(packed, **(fields | {"v_template": np.zeros((10**6, 3))}))
    monkeypatch.setattr(bodyfile, "LARGEST", packed.stat().st_size + 1000)
    with pytest.raises(BodyFileError, match="unpack to"):
        load_body(packed)
    monkeypatch.setattr(bodyfile, "LARGEST", path.stat().st_size - 1)
    with pytest.raises(BodyFileError, match="at most"):
        load_body(path)


@pytest.mark.parametrize(
    "name", ["v_template", "shapedirs", "J_regressor", "weights", "kintree_table", "f"]
)
def test_a_missing_field_is_named(tmp_path: Path, fields: Fields, name: str) -> None:
    del fields[name]
    for path in (write_npz(tmp_path / "b.npz", fields), write_pickle(tmp_path / "b.pkl", fields)):
        with pytest.raises(BodyFileError, match=f"^{name}: the field is missing"):
            load_body(path)


def test_object_arrays_are_refused(tmp_path: Path, fields: Fields) -> None:
    fields["J_regressor"] = np.array([scipy.sparse.csc_matrix(fields["J_regressor"])])
    for path in (write_npz(tmp_path / "b.npz", fields), write_pickle(tmp_path / "b.pkl", fields)):
        with pytest.raises(BodyFileError, match="J_regressor: is an object array"):
            load_body(path)


@pytest.mark.parametrize("joints", [5, 16, 24, 52, 55])
def test_other_trees_are_refused(tmp_path: Path, fields: Fields, joints: int) -> None:
    fields["kintree_table"] = np.array([range(-1, joints - 1), range(joints)])
    path = write_npz(tmp_path / "body.npz", fields)
    known = {52: "SMPL-H", 55: "SMPL-X"}.get(joints, "kintree_table")
    with pytest.raises(BodyFileError, match=rf"{known}.*SMPL's 24 joints"):
        load_body(path)


def _with(name: str, index: Any, value: float) -> Any:
    def change(fields: Fields) -> None:
        fields[name] = fields[name].astype(float)
        fields[name][index] = value

    return change


def _as(name: str, value: Any) -> Any:
    return lambda fields: fields.update({name: value})


@pytest.mark.parametrize(
    ("change", "name"),
    [
        (_with("v_template", (3, 1), np.nan), "v_template"),
        (_with("shapedirs", (3, 1, 9), np.inf), "shapedirs"),
        (_with("posedirs", (3, 1, 200), np.nan), "posedirs"),
        (_with("weights", (3, 1), 2.0), "weights"),
        (_with("J_regressor", (3, 1), np.nan), "J_regressor"),
        (_with("f", (3, 1), COUNT), "f"),
        (_with("f", (3, 1), -1), "f"),
        (_with("f", (3, 1), 0.5), "f"),
        (_as("v_template", np.zeros((COUNT + 1, 3))), "shapedirs"),
        (_as("v_template", np.zeros((0, 3))), "v_template"),
        (_as("v_template", np.full((COUNT, 3), "x")), "v_template"),
        (_as("shapedirs", np.zeros((COUNT, 3, 2))), "shapedirs"),
        (_as("posedirs", np.zeros((COUNT, 3, 93))), "posedirs"),
        (_as("weights", np.zeros((COUNT, 24))), "weights"),
        (_as("weights", np.ones((COUNT, 1))), "weights"),
        (_as("kintree_table", np.zeros(24)), "kintree_table"),
        (_as("shape_names", np.array(["one"])), "shape_names"),
    ],
)
def test_a_field_of_the_wrong_form_is_named(
    tmp_path: Path, fields: Fields, change: Any, name: str
) -> None:
    change(fields)
    with pytest.raises(BodyFileError, match=f"^{name}: "):
        load_body(write_npz(tmp_path / "body.npz", fields))
