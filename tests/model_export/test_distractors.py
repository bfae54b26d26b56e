from __future__ import annotations

from pathlib import Path

import numpy as np

from model_export.distractors import heaps, other_shapes


def test_heaps_are_of_all_kinds_and_the_same_each_time() -> None:
    found = heaps(12, 80, seed=0)
    assert all(samples.points.shape == (80, 3) for samples in found)
    assert all(np.isfinite(samples.points).all() for samples in found)
    flatness = [np.ptp(samples.points, axis=0) for samples in found]
    assert len({tuple(extent) for extent in flatness}) == 12
    again = heaps(12, 80, seed=0)
    assert all(np.array_equal(a.points, b.points) for a, b in zip(found, again, strict=True))
    assert not np.array_equal(found[0].points, heaps(1, 80, seed=1)[0].points)


def test_a_folders_shapes_are_split_and_those_of_the_category_left_out(meshes: Path) -> None:
    learn = other_shapes([meshes], None, 50, held_out=False)
    measure = other_shapes([meshes], None, 50, held_out=True)
    assert len(learn) + len(measure) == 10
    assert 0 < len(measure) < len(learn)
    but = other_shapes([meshes], "STAND[0-4]", 50, held_out=False)
    but += other_shapes([meshes], "STAND[0-4]", 50, held_out=True)
    assert len(but) == 5
    assert other_shapes([], None, 50, held_out=False) == []


def test_files_that_cannot_be_read_are_left_out(tmp_path: Path) -> None:
    for index in range(5):
        (tmp_path / f"bad{index}.ply").write_bytes(b"ply\nnonsense")
        (tmp_path / f"note{index}.txt").write_text("no mesh")
    assert other_shapes([tmp_path], None, 50, held_out=False) == []
    assert other_shapes([tmp_path], None, 50, held_out=True) == []
