from __future__ import annotations

import numpy as np
import pytest
import trimesh

from model_export.benchmark.accuracy import (
    dimension_error,
    edit_accuracy,
    locality,
    surface_accuracy,
)
from model_export.benchmark.continuity import evenness, monotone
from model_export.benchmark.crossed import Crossed
from model_export.benchmark.detail import edge_ratio, edges_of, laplacian_change
from model_export.benchmark.identity import digests, same_but_shape, there_and_back
from model_export.benchmark.service_checks import as_glb
from model_export.benchmark.symmetry import added_asymmetry, asymmetry
from model_export.benchmark.validity import contacts, degenerate, flips, gap, pieces


def square(width: float) -> tuple[np.ndarray, np.ndarray]:
    x = np.array([[0, 0, 0], [width, 0, 0], [width, 1, 0], [0, 1, 0]], float)
    return x, np.array([[0, 1, 2], [0, 2, 3]])


X, FACES = square(1.0)
TRUTH, _ = square(2.0)


def test_the_truth_is_off_by_nothing_and_doing_nothing_by_one() -> None:
    assert edit_accuracy(X, TRUTH, TRUTH) == (0.0, 0.0)
    mean, tail = edit_accuracy(X, X, TRUTH)
    # Two of four vertices move by 1, in the mean by a half.
    assert mean == pytest.approx(1.0)
    assert tail == pytest.approx(2.0)


def test_halfway_is_off_by_a_half() -> None:
    half = (X + TRUTH) / 2
    assert edit_accuracy(X, half, TRUTH)[0] == pytest.approx(0.5)
    # It is 1.5 wide where 2 were asked for.
    assert dimension_error(X, half, TRUTH, 2.0) == pytest.approx(25.0)
    assert dimension_error(X, TRUTH, TRUTH, 2.0) == pytest.approx(0.0)


def test_a_dimension_is_measured_between_what_moves_apart() -> None:
    centred, wider = X - [0.5, 0, 0], TRUTH - [1.0, 0, 0]
    shifted = wider + np.array([0.3, 0, 0])
    assert dimension_error(centred, shifted, wider, 2.0) == pytest.approx(0.0)
    # From 1 to .5, and it stayed 1: off by the whole of what there should be.
    narrower = centred * [0.5, 1, 1]
    assert dimension_error(centred, centred, narrower, 0.5) == pytest.approx(100.0)


def test_locality_counts_only_what_should_stay() -> None:
    y = TRUTH.copy()
    y[0, 1] -= 0.1
    assert locality(X, y, TRUTH) == pytest.approx(0.05 / np.sqrt(2))
    y = TRUTH.copy()
    y[1, 1] -= 0.1
    assert locality(X, y, TRUTH) == 0.0
    assert locality(X, y, TRUTH + 1.0) == 0.0


def test_a_mesh_made_anew_is_judged_by_its_nearest_points() -> None:
    mean, _, local = surface_accuracy(X, TRUTH, TRUTH[::-1] + np.array([0, 0, 0.25]))
    assert mean == pytest.approx(0.5)
    assert local == pytest.approx(0.25 / np.sqrt(2))


def test_an_edge_is_as_distorted_either_way() -> None:
    edges = edges_of(FACES)
    assert edges.tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]
    assert edge_ratio(X, X, edges) == (1.0, 1.0)
    assert edge_ratio(2.0 * X, X, edges) == pytest.approx((2.0, 2.0))
    assert edge_ratio(0.5 * X, X, edges) == pytest.approx((2.0, 2.0))
    # Two of five edges are twice as long, and the diagonal the square root of 5 over 2.
    mean, _ = edge_ratio(TRUTH, X, edges)
    assert np.log(mean) == pytest.approx((2 * np.log(2.0) + 0.5 * np.log(2.5)) / 5)


def test_detail_survives_a_move_and_scales_with_size() -> None:
    ball = trimesh.creation.icosphere(2)
    x, faces = np.array(ball.vertices), np.array(ball.faces)
    assert laplacian_change(x, x + np.array([1.0, 2.0, 3.0]), faces) < 1e-12
    assert laplacian_change(x, 1.25 * x, faces) == pytest.approx(0.25)


def test_a_turned_face_is_a_flip_and_a_flat_one_is_degenerate() -> None:
    turned = X.copy()
    turned[2] = [0.2, -0.5, 0.0]
    assert flips(turned, X, FACES) == 1
    assert flips(TRUTH, X, FACES) == 0
    flat = X.copy()
    flat[3] = [0.5, 0.5, 0.0]
    assert degenerate(flat, X, FACES) == 1
    assert degenerate(TRUTH, X, FACES) == 0


def test_what_touched_and_came_apart_leaves_a_gap_and_what_slid_does_not() -> None:
    low = trimesh.creation.box((1, 1, 1)).subdivide()
    high = low.copy().apply_translation([0, 1.001, 0])
    x = np.concatenate([low.vertices, high.vertices])
    faces = np.concatenate([low.faces, high.faces + len(low.vertices)])
    of = pieces(faces, len(x))
    assert of.max() == 1
    touching = contacts(x, of)
    assert {tuple(sorted(of[pair])) for pair in touching} == {(0, 1)}
    upper = (of == 1)[:, None]
    size = np.linalg.norm(np.ptp(x, axis=0))
    lifted = x + upper * np.array([0.0, 0.25, 0.0])
    slid = x + upper * np.array([0.01, 0.0, 0.0])
    assert gap(x, lifted, None, faces, touching) == pytest.approx(0.25 / size, rel=0.05)
    assert gap(x, lifted, lifted, faces, touching) == 0.0
    assert gap(x, slid, None, faces, touching) < 0.7 * 0.01 / size
    assert gap(x, x, None, faces, touching) == 0.0


def test_one_piece_touches_nothing() -> None:
    assert pieces(FACES, 4).max() == 0
    touching = contacts(X, pieces(FACES, 4))
    assert touching.shape == (0, 2)
    assert gap(X, TRUTH, None, FACES, touching) == 0.0


def test_a_side_that_moves_alone_is_asymmetric() -> None:
    assert asymmetry(X) == 0.0
    y = X.copy()
    y[1] += [0.0, -0.2, 0.0]
    # Each of the two lower vertices finds its mirror image .2 off; the diagonal has grown.
    assert asymmetry(y) == pytest.approx(0.1 / np.hypot(1.0, 1.2))
    assert added_asymmetry(X, TRUTH) == 0.0
    assert added_asymmetry(y, X) == 0.0


def test_even_steps_are_even_and_a_jump_is_not() -> None:
    assert evenness([X, X + 1.0, X + 2.0]) == pytest.approx(1.0)
    assert evenness([X, X + 1.0, X + 4.0]) == pytest.approx(1.5)
    assert monotone([1, 2, 3, 4], [10, 11, 15, 19]) == pytest.approx(1.0)
    assert monotone([1, 2, 3, 4], [4, 3, 2, 1]) == pytest.approx(-1.0)


def test_a_file_is_the_same_but_for_its_shape() -> None:
    upload, moved = as_glb(X, FACES).data, as_glb(TRUTH, FACES).data
    assert set(digests(upload)) == {"0.0.COLOR_0", "0.0.indices"}
    assert same_but_shape(upload, moved)
    assert not same_but_shape(upload, as_glb(TRUTH, FACES[:, [1, 2, 0]]).data)
    assert there_and_back(X, X + np.array([0.0, 0.0, 0.3])) == pytest.approx(0.3 / np.sqrt(2))


def plates(height: float) -> np.ndarray:
    """A square that lies, and one across it that stands at a height: four faces."""
    stands = np.array([[0.5, height, 0.2], [0.5, height, 0.8],
                       [0.5, height + 1, 0.8], [0.5, height + 1, 0.2]])  # fmt: skip
    return np.concatenate([X[:, [0, 2, 1]], stands])


def test_crossings_count_when_neither_the_input_nor_the_truth_has_them() -> None:
    faces = np.concatenate([FACES, FACES + 4])
    apart, through, deeper = plates(0.5), plates(-0.5), plates(-0.6)
    crossed = Crossed(apart, faces)
    found = crossed.found(through)
    assert len(crossed.before.faces) == 0
    assert len(found.faces) > 0
    assert len(set(found.pieces)) == 1
    assert len(found.beyond([crossed.before]).faces) == len(found.faces)
    assert len(found.beyond([crossed.before, crossed.found(through, 0.0)]).faces) == 0
    already = Crossed(through, faces)
    assert len(already.found(deeper).beyond([already.before]).pieces) == 0


def test_pieces_that_slide_cross_in_other_faces_but_are_no_new_pair() -> None:
    faces = np.concatenate([FACES, FACES + 4])
    beside = plates(-0.5)
    beside[4:, 0] += 0.3
    beside[4:, 2] = [0.05, 0.15, 0.15, 0.05]
    crossed = Crossed(beside, faces)
    fresh = crossed.found(plates(-0.5)).beyond([crossed.before])
    assert len(fresh.faces) > 0
    assert len(fresh.pieces) == 0


def test_faces_at_a_seam_do_not_cross() -> None:
    # The same square twice, folded along the seam between copies of its vertices.
    twice = np.concatenate([X, X * [-1.0, 1.0, 1.0]])
    folded = twice.copy()
    folded[4:, 2] += 0.3 * np.abs(folded[4:, 0])
    crossed = Crossed(twice, np.concatenate([FACES, FACES + 4]))
    assert len(crossed.found(folded).faces) == 0
