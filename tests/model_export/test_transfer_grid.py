from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from plain_chair import PLAIN

from model_export import transfer_grid
from model_export.realistic import RealisticShape
from model_export.rivals.cage import Cage
from model_export.transfer_grid import Pair, Shape, caged, distance, found, main, panels, table
from service.template.loader import load_template


def write_chair(path: Path, size: float = 1.0, **values: float) -> Path:
    template = load_template("paper_chair")
    parameters = PLAIN | values
    vertices = size * template.decode([parameters[name] for name in template.names])
    trimesh.Trimesh(vertices, template.faces, process=False).export(path)
    return path


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three chairs of two licences, and a stool that is no core shape."""
    rows = []
    for index, licence in enumerate(["CC0-1.0", "MIT", "CC0-1.0", "MIT"]):
        name = f"chair{index}.ply"
        write_chair(tmp_path / name, seat_width=0.4 + 0.1 * index)
        rows.append({"file": name, "id": f"chair{index}", "licence": licence, "core": index < 3})
    lines = "\n".join(json.dumps(row) for row in rows)
    (tmp_path / "manifest.jsonl").write_text(lines, "utf-8")
    return tmp_path


def shape(path: Path) -> Shape:
    return Shape.of(path.stem, path, 1.0)


def test_shapes_are_brought_to_one_diagonal(tmp_path: Path) -> None:
    small, large = (shape(write_chair(tmp_path / f"{size:g}.ply", size)) for size in (0.01, 100.0))
    for own in (small, large):
        assert np.linalg.norm(np.ptp(own.vertices, axis=0)) == pytest.approx(1.0)
    np.testing.assert_allclose(small.vertices, large.vertices, atol=1e-5)
    assert Shape.of("own", tmp_path / "100.ply", None).vertices.max() > 10


def test_a_shape_is_no_way_from_itself_and_some_way_from_others(tmp_path: Path) -> None:
    one = shape(write_chair(tmp_path / "one.ply"))
    other = shape(write_chair(tmp_path / "other.ply", leg_height=0.7))
    assert distance(one, one) < 1e-3 < 0.01 < distance(one, other)


def test_a_cage_comes_nearer_than_stretching_and_a_change_of_axes_is_exact(tmp_path: Path) -> None:
    one = shape(write_chair(tmp_path / "one.ply"))
    other = shape(write_chair(tmp_path / "other.ply", back_height=0.7, leg_height=0.3))
    cage = Cage.about(one.vertices)
    np.testing.assert_allclose(cage.weights @ cage.corners, one.vertices, atol=1e-6)
    ratio = np.ptp(other.vertices, axis=0) / np.ptp(one.vertices, axis=0)
    stretched = one.moved(one.vertices * ratio)
    shift = other.vertices.min(axis=0) - stretched.vertices.min(axis=0)
    plain = distance(stretched.moved(stretched.vertices + shift), other)
    assert caged(one, other, cage) < 0.7 * plain
    wider = one.moved(one.vertices * [1.3, 1.0, 0.8])
    assert caged(one, wider, cage) < 1e-3


def test_held_out_shapes_are_taken_by_licence(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    find = transfer_grid.find_shapes

    def all_held_out(path: Path) -> list[RealisticShape]:
        return [replace(own, held_out=True) for own in find(path)]

    assert found([folder], []) == [s for s in find(folder) if s.held_out and s.info["core"]]
    monkeypatch.setattr(transfer_grid, "find_shapes", all_held_out)
    assert [s.name for s in found([folder], ["MIT", "CC0-1.0"])] == ["chair1", "chair0", "chair2"]
    assert [s.name for s in found([folder], ["MIT"])] == ["chair1"]
    assert [s.name for s in found([folder / "chair3.ply"], ["MIT"])] == ["chair3"]


def test_the_table_tells_how_often_the_transfer_is_nearer(tmp_path: Path) -> None:
    own = shape(write_chair(tmp_path / "own.ply"))
    grid = [[Pair(own, 0.04, 0.02, 0.03, 0.01), Pair(own, 0.02, 0.01, 0.02, 0.03)]]
    assert table(grid).splitlines()[2:] == [
        "| source | 3.00 | 3.00 | 50 % of 2 |",
        "| stretched | 1.50 | 1.50 | 50 % of 2 |",
        "| caged | 2.50 | 2.50 | 50 % of 2 |",
        "| transferred | 2.00 | 2.00 |  |",
    ]


def test_the_grid_has_bands_of_targets(tmp_path: Path) -> None:
    own = shape(write_chair(tmp_path / "own.ply"))
    pair = Pair(own, 0.1, 0.1, 0.1, 0.1)
    drawn = panels([own, own], [own] * 3, [[pair] * 3] * 2, across=2)
    assert len(drawn) == 2 * (1 + 2) * (1 + 2)
    assert [bool(panel.meshes) for panel in drawn] == (
        [False, True, True]
        + 2 * [True, True, True]
        + [False, True, False]
        + 2 * [True, True, False]
    )


def test_it_is_drawn_and_measured_by_one_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_chair(tmp_path / "source.ply")
    targets = [
        write_chair(tmp_path / "wide.ply", 100.0, seat_width=0.65),
        write_chair(tmp_path / "high.ply", leg_height=0.7),
    ]
    out = tmp_path / "pictures" / "grid.png"
    arguments = ["--sources", source, "--targets", *targets, source, "--out", out]
    monkeypatch.setattr("sys.argv", ["transfer_grid", *map(str, arguments)])
    main()
    assert out.read_bytes().startswith(b"\x89PNG")
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[:2] for line in lines[:2]] == [["source", "wide"], ["source", "high"]]
    last = lines[-1].split("|")
    assert last[1].strip() == "transferred"
    # Boxes like boxes: the transfer leaves next to nothing.
    assert float(last[2]) < 0.5
    assert "100 % of 2" in lines[-4]
