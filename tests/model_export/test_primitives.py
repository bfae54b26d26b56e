from __future__ import annotations

import numpy as np
import pytest
import trimesh

from model_export.primitives import Mesh, bar, join, slab, tube


def solid(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(*mesh, process=True)


def test_a_slab_fills_its_box_but_for_its_rounding() -> None:
    made = solid(slab([1.0, 2.0, 3.0], [0.4, 0.1, 0.6], 0.01, 2))
    np.testing.assert_allclose(made.bounds.mean(axis=0), [1, 2, 3], atol=1e-9)
    np.testing.assert_allclose(made.extents, [0.4, 0.1, 0.6], atol=1e-9)
    assert made.is_watertight
    assert 0.95 * 0.024 < made.volume < 0.024


@pytest.mark.parametrize("square", [True, False])
def test_a_bar_runs_from_end_to_end(square: bool) -> None:
    made = solid(bar([0, 0, 0], [0, 0.5, 0], [0.02, 0.03], 2, square))
    assert made.is_watertight
    assert made.extents[1] == pytest.approx(0.5)
    full = 0.04 * 0.06 * 0.5
    assert made.volume == pytest.approx(full if square else full * np.pi / 4, rel=0.12)


def test_a_tube_follows_its_path() -> None:
    path = np.array([[0.0, 0, 0], [0, 1, 0], [0.5, 2, 0]])
    made = solid(tube(path, np.full((3, 2), 0.05), 8, False))
    assert made.is_watertight
    assert made.extents[1] == pytest.approx(2.0, abs=0.1)


def test_joining_keeps_every_piece() -> None:
    one, two = (slab([x, 0, 0], [0.2, 0.2, 0.2], 0.01, 1) for x in (0.0, 1.0))
    vertices, faces = join([one, two])
    assert (len(vertices), len(faces)) == (2 * len(one[0]), 2 * len(one[1]))
    assert len(solid((vertices, faces)).split()) == 2
