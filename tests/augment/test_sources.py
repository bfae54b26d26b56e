"""Which files are worked on."""

from __future__ import annotations

from pathlib import Path

import pytest

from service.augment.plan import Task
from service.augment.sources import find_files, find_tasks, read_shard
from service.errors import InvalidRequest, NotFound


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("b.glb", "a.OBJ", "deep/er/c.zip", "notes.txt", ".hidden.glb", ".git/d.glb"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(name)
    return tmp_path


def test_meshes_are_found_at_any_depth(folder: Path) -> None:
    found = [path.relative_to(folder).as_posix() for path in find_files(folder, folder / "out")]
    assert found == ["a.OBJ", "b.glb", "deep/er/c.zip"]


def test_what_was_written_is_no_source(folder: Path) -> None:
    assert len(find_files(folder, folder / "deep")) == 2


def test_a_folder_without_meshes_is_told_of(tmp_path: Path) -> None:
    with pytest.raises(NotFound) as caught:
        find_files(tmp_path, tmp_path / "out")
    assert caught.value.code == "no_meshes"
    with pytest.raises(NotFound) as caught:
        find_files(tmp_path / "none", tmp_path / "out")
    assert caught.value.code == "no_folder"


def tasks(folder: Path, shard: str = "1/1") -> list[Task]:
    return find_tasks(folder, find_files(folder, folder / "out"), shard, lambda: None)


def test_equal_files_are_one_source(folder: Path) -> None:
    (folder / "z.glb").write_text("b.glb")
    found = {task.source: task.copies for task in tasks(folder)}
    assert found == {"a.OBJ": (), "b.glb": ("z.glb",), "deep/er/c.zip": ()}


def test_shards_are_parts_of_the_whole(folder: Path) -> None:
    for index in range(20):
        (folder / f"more-{index}.ply").write_text(str(index))
    whole = {task.source for task in tasks(folder)}
    shares = [{task.source for task in tasks(folder, f"{i}/3")} for i in (1, 2, 3)]
    assert set.union(*shares) == whole
    assert sum(map(len, shares)) == len(whole)
    assert all(shares)


@pytest.mark.parametrize("shard", ["", "0/2", "3/2", "1", "a/b", "1/0", "-1/2"])
def test_shards_that_make_no_sense_are_told_of(shard: str) -> None:
    with pytest.raises(InvalidRequest) as caught:
        read_shard(shard)
    assert caught.value.code == "shard_malformed"


def test_names_are_those_of_files_anywhere() -> None:
    task = Task(Path("x"), "deep/..strange name?.glb", "ab" * 32)
    assert task.name == "strange_name_-" + "ab" * 8
