"""Labels of vertices."""

from __future__ import annotations

import numpy as np
import trimesh

from service.augment.labels import category_parts, nearest_parts
from service.augment.variants import Source
from service.template.loader import load_template


def test_a_chair_of_boxes_is_labelled_box_by_box(
    chair_source: Source, box_chair: trimesh.Trimesh
) -> None:
    found = chair_source.labels
    assert found.parts == category_parts(chair_source.found.model)
    assert found.labels.dtype == np.int16
    assert len(found.labels) == len(chair_source.found.mesh.vertices)
    truth = load_template("paper_chair")
    names = np.array(found.parts)[found.labels]
    for index, part in enumerate(truth.parts):
        own = names[truth.part == index]
        kind = "leg" if "leg" in part else part
        assert (np.char.find(own, kind) >= 0).mean() > 0.7, part


def test_legs_are_told_apart(chair_source: Source) -> None:
    found = chair_source.labels
    x = chair_source.found.vertices[:, 0]
    for name, sign in (("front_left_leg", 1.0), ("front_right_leg", -1.0)):
        own = found.labels == found.parts.index(name)
        assert own.any()
        assert (sign * x[own] > 0).all()


def test_a_piece_near_one_part_is_of_it_as_a_whole() -> None:
    """A cushion on the first part, whose last vertex is nearer to the second."""
    distances = np.float32([[0.01, 0.2], [0.01, 0.1], [0.02, 0.005]])
    assert nearest_parts(distances, np.zeros(3, np.int64)).tolist() == [0, 0, 0]


def test_what_reaches_far_from_a_part_is_not_of_it() -> None:
    """A fin of few vertices on a fuselage of many."""
    distances = np.float32([[0.0, 0.4]] * 40 + [[0.15, 0.0]])
    assert nearest_parts(distances, np.zeros(41, np.int64)).tolist() == [0] * 40 + [1]


def test_a_stretcher_is_of_the_parts_that_it_joins() -> None:
    """The middle of the second piece is nearest to a part that it does not touch."""
    distances = np.float32(
        [[0.0, 0.5, 0.5], [0.3, 0.0, 0.4], [0.1, 0.2, 0.25], [0.1, 0.25, 0.2], [0.3, 0.4, 0.0]]
    )
    piece = np.array([0, 1, 1, 1, 1])
    assert nearest_parts(distances, piece).tolist() == [0, 1, 1, 2, 2]


def test_pieces_may_lie_in_any_order() -> None:
    distances = np.float32([[0.0, 0.5], [0.5, 0.0], [0.0, 0.5], [0.5, 0.0]])
    assert nearest_parts(distances, np.array([1, 0, 1, 0])).tolist() == [0, 1, 0, 1]
