from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import torch

from model_export import realistic
from model_export.realistic import (
    CLOUD_SIZE,
    RealisticShapes,
    find_shapes,
    load_cloud,
    normalise,
)
from service.errors import ShapeError
from service.mesh.surface import Normalization

BOX = """v 0 0 0
v 2 0 0
v 2 1 0
v 0 1 0
f 1 2 3 4
"""


@pytest.fixture
def listed(tmp_path: Path) -> Path:
    """A folder with a manifest of 40 flat meshes in 20 groups of near duplicates."""
    rows = []
    for index in range(40):
        (tmp_path / f"m{index}.obj").write_text(BOX.replace("v 2", f"v {2 + index}"), "utf-8")
        row = {"id": f"mesh {index}", "file": f"m{index}.obj", "near_dup_group": f"g{index // 2}",
               "licence": "CC0-1.0"}  # fmt: skip
        rows.append(json.dumps(row))
    (tmp_path / "unlisted.obj").write_text(BOX, "utf-8")
    (tmp_path / "manifest.jsonl").write_text("\n".join([*rows, "", ""]), "utf-8")
    return tmp_path


def test_a_folder_needs_no_manifest(meshes: Path, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("no mesh", "utf-8")
    assert find_shapes(tmp_path) == []
    found = find_shapes(meshes)
    assert {shape.name for shape in found} == {f"stand{index}" for index in range(10)}
    assert all(shape.path.is_file() for shape in found)
    assert sum(shape.held_out for shape in found) == 2


def test_a_manifest_says_which_files_and_what_they_are(listed: Path) -> None:
    found = find_shapes(listed)
    assert [shape.name for shape in found] == [f"mesh {index}" for index in range(40)]
    assert found[3].path == listed / "m3.obj"
    assert found[3].info["licence"] == "CC0-1.0"


def test_a_manifest_may_name_files_only(tmp_path: Path) -> None:
    (tmp_path / "manifest.jsonl").write_text('{"file": "a/b.obj"}\n{"file": "c.ply"}\n', "utf-8")
    assert [shape.name for shape in find_shapes(tmp_path)] == ["b", "c"]


def test_a_fifth_is_held_out_and_near_duplicates_stay_together(listed: Path) -> None:
    found = find_shapes(listed)
    assert sum(shape.held_out for shape in found) == 8
    sides: dict[str, set[bool]] = {}
    for shape in found:
        sides.setdefault(str(shape.info["near_dup_group"]), set()).add(shape.held_out)
    assert all(len(side) == 1 for side in sides.values())
    assert find_shapes(listed) == found


@pytest.mark.parametrize(
    ("entries", "kept"),
    [
        (("near_dup_group", "family", "group"), "near_dup_group"),
        (("family", "group"), "family"),
        (("group",), "group"),
    ],
)
def test_the_closest_kinship_that_a_manifest_names_stays_together(
    tmp_path: Path, entries: tuple[str, ...], kept: str
) -> None:
    sizes = {"near_dup_group": 2, "family": 4, "group": 5}
    rows = [
        {"file": f"m{index}.obj", **{entry: f"{entry}{index // sizes[entry]}" for entry in entries}}
        for index in range(80)
    ]
    (tmp_path / "manifest.jsonl").write_text("\n".join(map(json.dumps, rows)), "utf-8")
    found = find_shapes(tmp_path)
    assert sum(shape.held_out for shape in found) == 80 // 5 // sizes[kept] * sizes[kept]
    for group in {shape.info[kept] for shape in found}:
        sides = {shape.held_out for shape in found if shape.info[kept] == group}
        assert len(sides) == 1


def test_the_two_sides_have_no_shape_in_common(listed: Path, tmp_path: Path) -> None:
    train = RealisticShapes(listed, tmp_path / "cache", seed=0)
    test = RealisticShapes(listed, tmp_path / "cache", seed=0, held_out=True)
    assert (len(train), len(test)) == (32, 8)
    assert set(train.names).isdisjoint(test.names)


def test_clouds_lie_on_the_mesh(listed: Path, tmp_path: Path) -> None:
    shape = find_shapes(listed)[5]
    cloud = load_cloud(shape, tmp_path / "cache")
    assert (cloud.shape, cloud.dtype) == ((CLOUD_SIZE, 3), np.float32)
    # About its mean: a mesh far from its origin keeps its digits.
    np.testing.assert_allclose(cloud.mean(axis=0), [0, 0, 0], atol=1e-5)
    np.testing.assert_allclose(np.ptp(cloud, axis=0), [7, 1, 0], atol=0.02)


def test_the_cache_is_read_back_and_keyed_by_content(listed: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    first, second = find_shapes(listed)[:2]
    cloud = load_cloud(first, cache)
    (cached,) = cache.iterdir()
    np.save(cached, np.ones((CLOUD_SIZE, 3), np.float32))
    assert (load_cloud(first, cache) == 1).all()
    assert not (load_cloud(second, cache) == 1).all()
    cached.unlink()
    assert np.array_equal(load_cloud(first, cache), cloud)


def test_an_unreadable_file_is_skipped_and_named(listed: Path, tmp_path: Path) -> None:
    (listed / "m7.obj").write_text("v 0 0 0\nf 1 2 9\n", "utf-8")
    bad = next(shape for shape in find_shapes(listed) if shape.name == "mesh 7")
    with pytest.raises(ShapeError):
        load_cloud(bad, tmp_path / "cache")
    shapes = RealisticShapes(listed, tmp_path / "cache", seed=0, held_out=bad.held_out)
    assert "mesh 7" not in shapes.names
    (skipped,) = shapes.skipped
    assert skipped.startswith("mesh 7: ")


def test_a_folder_without_meshes_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no readable mesh"):
        RealisticShapes(tmp_path, tmp_path / "cache", seed=0)


def test_batches_are_normalised_and_repeat_with_the_seed(listed: Path, tmp_path: Path) -> None:
    first, again, other = (RealisticShapes(listed, tmp_path / "c", seed) for seed in (1, 1, 2))
    batch = first.batch(9, 200)
    assert batch.shape == (9, 200, 3)
    assert batch.dtype == torch.float32
    assert batch.mean(dim=1).abs().max() < 1e-6
    np.testing.assert_allclose(batch.norm(dim=2).amax(dim=1), 0.6, rtol=1e-5)
    assert torch.equal(batch, again.batch(9, 200))
    assert not torch.equal(batch, other.batch(9, 200))


def test_every_shape_comes_once_in_each_round(listed: Path, tmp_path: Path) -> None:
    shapes = RealisticShapes(listed, tmp_path / "cache", seed=0, noise=0.0)
    # Flat rectangles of different lengths: the ratio of the sides tells which it is.
    clouds = torch.cat([shapes.batch(8, 4000) for _ in range(8)])
    ratio = np.ptp(clouds.numpy(), axis=1)
    lengths = Counter(np.rint(ratio[:, 0] / ratio[:, 1]).astype(int).tolist())
    assert len(lengths) == 32
    assert set(lengths.values()) == {2}


def test_half_of_the_clouds_are_mirrored(tmp_path: Path) -> None:
    # A triangle with its right angle on the left.
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "utf-8")
    shapes = RealisticShapes(tmp_path, tmp_path / "cache", seed=3, noise=0.0)
    clouds = shapes.batch(60, 100)
    mirrored = (clouds[:, :, 0].amax(dim=1) < -clouds[:, :, 0].amin(dim=1)).sum().item()
    assert 15 <= mirrored <= 45


def test_noise_stays_below_its_level(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(BOX, "utf-8")
    noisy = RealisticShapes(tmp_path, tmp_path / "cache", seed=3, noise=0.02).batch(40, 400)
    clean = RealisticShapes(tmp_path, tmp_path / "cache", seed=3, noise=0.0).batch(40, 400)
    assert clean[:, :, 2].abs().max() < 1e-6
    spread = noisy[:, :, 2].std(dim=1)
    assert 0.004 < spread.max() < 0.02 * 0.6 * 1.1
    assert spread.min() < 0.001


def test_normalise_is_the_services_normalisation() -> None:
    clouds = torch.randn(3, 50, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    for cloud, done in zip(clouds.numpy(), normalise(clouds).numpy(), strict=True):
        np.testing.assert_allclose(done, Normalization.of(cloud).apply(cloud), atol=1e-12)


def test_clouds_can_be_taken_to_a_machine_without_the_meshes(
    listed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    file = tmp_path / "clouds.npz"
    arguments = ["realistic", str(listed), "--out", str(file), "--cache", str(tmp_path / "cache")]
    monkeypatch.setattr("sys.argv", arguments)
    realistic.main()
    assert "wrote 32 shapes to train on, 0 unreadable" in capsys.readouterr().out
    here = RealisticShapes(listed, tmp_path / "cache", seed=0)
    there = RealisticShapes(file, tmp_path / "no cache", seed=0)
    assert there.names == here.names
    assert torch.allclose(there.clouds, here.clouds, atol=2e-5)
    assert torch.allclose(there.batch(5, 100), here.batch(5, 100), atol=1e-3)


def test_what_is_drawn_can_be_drawn_again_from_anywhere(listed: Path, tmp_path: Path) -> None:
    first, second = (RealisticShapes(listed, tmp_path / "cache", seed=0) for _ in range(2))
    first.batch(40, 10)
    first.reseed(7, 40)
    second.reseed(7, 40)
    assert torch.equal(first.batch(9, 50), second.batch(9, 50))
