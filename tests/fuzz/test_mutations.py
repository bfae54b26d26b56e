from __future__ import annotations

import io
import json
import struct
import zipfile
from random import Random

import pytest

from service.mesh.glb import read_chunks

from .corpus import formats, gathered
from .mutations import MUTATIONS, Mutation, member, mutate, tree


@pytest.mark.parametrize("format", formats())
def test_the_same_seed_is_the_same_damage(format: str) -> None:
    for number, data in enumerate(gathered(format, None)):
        assert mutate(data, Random(number), data) == mutate(data, Random(number), data)


@pytest.mark.parametrize("mutation", sorted({*MUTATIONS, member}, key=lambda item: item.__name__))
def test_each_way_takes_any_bytes_and_changes_some(mutation: Mutation) -> None:
    changed = 0
    text = struct.pack("<4sIIII4s", b"glTF", 2, 24, 4, 0x4E4F534A, b'"ab"')
    for data in (b"", b"\0", b"ply\n", b"{}", text, b"glTF" + bytes(30), *gathered("glb", None),
                 *gathered("ply", None), *gathered("zip", None)):  # fmt: skip
        changed += sum(mutation(data, Random(seed)) != data for seed in range(20))
    assert changed > 50


def test_a_changed_tree_stays_a_file_of_its_kind() -> None:
    data = gathered("glb", None)[0]
    trees = set()
    for seed in range(50):
        changed = tree(data, Random(seed))
        chunks = read_chunks(changed)
        assert struct.unpack_from("<I", changed, 8)[0] == len(changed)
        trees.add(json.dumps(json.loads(changed[chunks[0].start : chunks[0].end])))
        assert changed.endswith(data[read_chunks(data)[0].end :])
    assert len(trees) > 25


def test_a_changed_member_leaves_a_sound_archive() -> None:
    for data in gathered("zip", None):
        sound = zipfile.ZipFile(io.BytesIO(data))
        for seed in range(20):
            with zipfile.ZipFile(io.BytesIO(member(data, Random(seed)))) as archive:
                assert archive.testzip() is None
                assert archive.namelist() == sound.namelist()
                names = archive.namelist()
                assert sum(archive.read(name) != sound.read(name) for name in names) <= 1
