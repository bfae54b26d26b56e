from __future__ import annotations

import numpy as np
import pytest

from service.deform.assemblies import MANY, Assemblies, hung, joined, touching_pieces

NONE = np.zeros((1, 3), bool)


def chain(count: int) -> np.ndarray:
    """Each piece touches the next."""
    index = np.arange(count)
    return np.abs(index[:, None] - index) <= 1


def test_boxes_touch_across_a_hair_and_not_across_a_hand() -> None:
    low = np.array([[0.0, 0, 0], [0.101, 0, 0], [0.3, 0, 0]])
    touching = touching_pieces(low, low + 0.1)
    assert touching.tolist() == [[True, True, False], [True, True, False], [False, False, True]]


def test_of_too_many_pieces_none_touch() -> None:
    low = np.zeros((MANY + 1, 3))
    assert (touching_pieces(low, low + 1.0) == np.eye(MANY + 1, dtype=bool)).all()


def test_members_that_touch_have_one_extent() -> None:
    member = np.ones((4, 1, 3), bool)
    member[2] = False
    low = np.arange(4, dtype=np.float32).reshape(4, 1, 1).repeat(3, axis=2)
    bottom, top = Assemblies(member, chain(4)).extents(low, low + 2)
    # The third is none of them, and without it the fourth touches none.
    assert bottom[:, 0, 0].tolist() == [0, 0, 2, 3]
    assert top[:, 0, 0].tolist() == [3, 3, 4, 5]


def test_an_assembly_touches_where_its_nearest_piece_does() -> None:
    member = np.ones((2, 1, 3), bool)
    low = np.float32([[[0.3] * 3], [[-0.9] * 3]])
    high = np.float32([[[0.4] * 3], [[-0.7] * 3]])
    apart = Assemblies(member, np.eye(2, dtype=bool)).contacts(low, high, np.float32([[0], [0.1]]))
    assert apart[:, 0, 0].tolist() == pytest.approx([0.3, -0.7])
    whole = Assemblies(member, chain(2)).contacts(low, high, np.float32([[0.0], [0.1]]))
    assert whole[:, 0, 0].tolist() == pytest.approx([0.3, 0.3])
    both = Assemblies(member, chain(2)).contacts(low, high, np.float32([[0.0], [0.001]]))
    assert both[:, 0, 0].tolist() == [0.0, 0.0]


def test_small_pieces_join_what_hangs_and_only_along_the_part() -> None:
    hanging = np.zeros((3, 1, 3), bool)
    hanging[2] = True
    extent = np.full((3, 1, 3), 0.03, np.float32)
    assert joined(hanging, extent, chain(3), NONE)[:, 0].tolist() == [False, True, True]
    assert not joined(hanging, 10 * extent, chain(3), NONE).any()
    assert not joined(hanging, extent, chain(3), ~NONE).any()


def test_what_floats_goes_with_what_holds_it_along_a_chain() -> None:
    shares = np.float32([[0, 1], [1, 0], [1, 0]])
    extent = np.ones((3, 1, 3), np.float32)
    distance = np.float32([0.0, 0.1, 0.2])
    assert hung(shares, distance, extent, chain(3)).tolist() == [[0, 1], [0, 1], [0, 1]]
    alone = hung(shares, distance, extent, np.eye(3, dtype=bool))
    np.testing.assert_array_equal(alone, shares)


def test_of_two_that_hold_it_the_smaller_does() -> None:
    shares = np.float32([[1, 0], [1, 0], [0, 1]])
    extent = np.float32([9, 1, 2]).reshape(3, 1, 1).repeat(3, axis=2)
    distance = np.float32([0.0, 0.1, 0.0])
    assert hung(shares, distance, extent, chain(3))[1].tolist() == [0, 1]


def test_a_piece_that_is_left_to_its_vertices_holds_nothing() -> None:
    shares = np.float32([[np.nan, np.nan], [1, 0]])
    extent = np.ones((2, 1, 3), np.float32)
    found = hung(shares, np.float32([0.0, 0.1]), extent, chain(2))
    assert np.isnan(found[0]).all()
    assert found[1].tolist() == [1, 0]
