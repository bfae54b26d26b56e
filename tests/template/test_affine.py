from __future__ import annotations

import numpy as np
import pytest

from service.template.affine import AffineTemplate
from service.template.loader import load_template

NAMES = (
    "back_height",
    "back_thickness",
    "seat_thickness",
    "seat_depth",
    "seat_width",
    "leg_height",
    "leg_depth",
    "leg_width",
)
LEGS = ("front_right_leg", "front_left_leg", "rear_right_leg", "rear_left_leg")


@pytest.fixture(scope="module")
def chair() -> AffineTemplate:
    return load_template("paper_chair")


@pytest.fixture(scope="module")
def f(chair: AffineTemplate) -> np.ndarray:
    """Eight values, all different."""
    values = {
        "back_height": 0.42,
        "back_thickness": 0.04,
        "seat_thickness": 0.06,
        "seat_depth": 0.45,
        "seat_width": 0.50,
        "leg_height": 0.38,
        "leg_depth": 0.05,
        "leg_width": 0.03,
    }
    return np.array([values[name] for name in chair.names])


def part_box(chair: AffineTemplate, f: np.ndarray, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner of a part's bounding box."""
    vertices = chair.decode(f)[chair.part == chair.parts.index(name)]
    return vertices.min(axis=0), vertices.max(axis=0)


def test_the_chair_has_the_papers_counts(chair: AffineTemplate) -> None:
    assert chair.base.shape == (2840, 3)
    assert chair.jacobian.shape == (2840, 3, 8)
    assert chair.points == 2840
    assert chair.names == NAMES
    assert set(chair.parts) == {"seat", "back", *LEGS}
    assert len(chair.parts) == 6
    assert np.array_equal(np.unique(chair.part), np.arange(6))
    assert chair.faces.max() == 2839
    assert chair.faces.dtype == chair.part.dtype == np.int64
    assert chair.hidden.dtype == np.bool_


def test_ranges_are_positive_and_hold_what_is_typical(chair: AffineTemplate) -> None:
    assert (chair.low > 0).all()
    assert (chair.low < chair.high).all()
    for parameter in chair.parameters:
        assert parameter.low <= parameter.typical[0] < parameter.typical[1] <= parameter.high


def test_parameters_know_the_papers_words(chair: AffineTemplate) -> None:
    words = {parameter.name: parameter.paper for parameter in chair.parameters}
    assert words["seat_thickness"] == "seat height"
    assert words["back_thickness"] == "back depth"


def test_decoding_is_the_base_plus_the_jacobian_times_the_parameters(
    chair: AffineTemplate,
) -> None:
    f = np.random.default_rng(0).uniform(chair.low, chair.high, (3, 8))
    vertices = chair.decode(f)
    assert vertices.shape == (3, 2840, 3)
    for row, decoded in zip(f, vertices, strict=True):
        np.testing.assert_allclose(decoded, chair.base + chair.jacobian @ row, atol=1e-14)
        np.testing.assert_allclose(chair.decode(row), decoded, atol=1e-15)


def test_the_jacobian_is_the_derivative(chair: AffineTemplate, f: np.ndarray) -> None:
    h = 1e-4
    for index, step in enumerate(h * np.eye(8)):
        slope = (chair.decode(f + step) - chair.decode(f - step)) / (2 * h)
        np.testing.assert_allclose(slope, chair.jacobian[:, :, index], atol=1e-10)


def test_every_parameter_moves_something_and_no_two_alike(chair: AffineTemplate) -> None:
    columns = chair.jacobian.reshape(-1, 8)
    assert np.linalg.matrix_rank(columns) == 8


def test_a_chair_is_as_large_as_its_parameters_say(chair: AffineTemplate, f: np.ndarray) -> None:
    value = dict(zip(chair.names, f, strict=True))
    sizes = {
        "seat": ("seat_width", "seat_thickness", "seat_depth"),
        "back": ("seat_width", "back_height", "back_thickness"),
        **dict.fromkeys(LEGS, ("leg_width", "leg_height", "leg_depth")),
    }
    for part, names in sizes.items():
        low, high = part_box(chair, f, part)
        np.testing.assert_allclose(high - low, [value[name] for name in names], atol=1e-14)


def test_the_seat_is_at_the_origin_and_the_back_stands_on_its_rear_edge(
    chair: AffineTemplate, f: np.ndarray
) -> None:
    seat_low, seat_high = part_box(chair, f, "seat")
    back_low, back_high = part_box(chair, f, "back")
    np.testing.assert_allclose(seat_low, -seat_high, atol=1e-15)
    assert back_low[1] == pytest.approx(seat_high[1])
    assert back_low[2] == pytest.approx(seat_low[2])
    assert (back_low[0], back_high[0]) == pytest.approx((seat_low[0], seat_high[0]))


def test_legs_hang_at_the_corners_of_the_seat(chair: AffineTemplate, f: np.ndarray) -> None:
    seat_low, seat_high = part_box(chair, f, "seat")
    for leg in LEGS:
        low, high = part_box(chair, f, leg)
        assert high[1] == pytest.approx(seat_low[1])
        # A chair that faces +Z has its right side towards -X.
        if "right" in leg:
            assert low[0] == pytest.approx(seat_low[0])
        else:
            assert high[0] == pytest.approx(seat_high[0])
        if "front" in leg:
            assert high[2] == pytest.approx(seat_high[2])
        else:
            assert low[2] == pytest.approx(seat_low[2])


def test_frames_carry_unit_shapes_to_the_vertices(chair: AffineTemplate, f: np.ndarray) -> None:
    other = f * np.linspace(0.6, 1.7, 8)
    before, after = chair.frames(f), chair.frames(other)
    assert before.shape == (6, 3, 4)
    start, end = chair.decode(f), chair.decode(other)
    for part in range(6):
        own = chair.part == part
        unit = np.linalg.solve(before[part, :, :3], (start[own] - before[part, :, 3]).T).T
        np.testing.assert_allclose(np.abs(unit).max(axis=0), 0.5, atol=1e-12)
        moved = unit @ after[part, :, :3].T + after[part, :, 3]
        np.testing.assert_allclose(moved, end[own], atol=1e-12)


def test_normals_of_boxes_are_exact(chair: AffineTemplate, f: np.ndarray) -> None:
    vertices = chair.decode(f)
    normals = chair.normals(vertices)
    # Sides share no vertices: a vertex's normal is that of each face it belongs to.
    a, b, c = (vertices[chair.faces[:, corner]] for corner in range(3))
    facing = np.cross(b - a, c - a)
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    for corner in range(3):
        np.testing.assert_allclose(normals[chair.faces[:, corner]], facing, atol=1e-12)
    np.testing.assert_allclose(np.sort(np.abs(normals), axis=1), [[0, 0, 1]] * 2840, atol=1e-12)
    outward = vertices - chair.frames(f)[chair.part, :, 3]
    assert (np.einsum("vc,vc->v", normals, outward) > 0).all()


def test_normals_of_a_flat_part_are_finite(chair: AffineTemplate) -> None:
    normals = chair.normals(np.zeros((2840, 3)))
    assert not normals.any()


def test_face_areas_add_up_to_those_of_the_boxes(chair: AffineTemplate, f: np.ndarray) -> None:
    areas = chair.face_areas(chair.decode(f))
    part = chair.part[chair.faces[:, 0]]
    for index, name in enumerate(chair.parts):
        low, high = part_box(chair, f, name)
        a, b, c = high - low
        assert areas[part == index].sum() == pytest.approx(2 * (a * b + b * c + c * a))


def test_hidden_faces_are_those_that_another_part_covers(
    chair: AffineTemplate, f: np.ndarray
) -> None:
    vertices = chair.decode(f)
    corners = vertices[chair.faces]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    just_outside = corners.mean(axis=1) + 1e-6 * facing
    covered = np.zeros(len(chair.faces), bool)
    for name in chair.parts:
        low, high = part_box(chair, f, name)
        covered |= ((just_outside > low) & (just_outside < high)).all(axis=1)
    # The seat is covered in places only, which move with the parameters: it stays visible.
    on_seat = chair.part[chair.faces[:, 0]] == chair.parts.index("seat")
    assert np.array_equal(chair.hidden, covered & ~on_seat)
    assert chair.hidden.any()


def test_anchors_are_where_they_are_said_to_be(chair: AffineTemplate, f: np.ndarray) -> None:
    vertices = chair.decode(f)
    low, high = vertices[:, 1].min(), vertices[:, 1].max()
    heights = {"floor": low, "seat": 0.0, "center": (low + high) / 2}
    assert tuple(chair.anchors) == tuple(heights)
    for name, height in heights.items():
        constant, jacobian = chair.anchor(name)
        assert (constant.shape, jacobian.shape) == ((3,), (3, 8))
        np.testing.assert_allclose(constant + jacobian @ f, [0, height, 0], atol=1e-14)


def test_relations_refuse_legs_wider_than_the_seat(chair: AffineTemplate, f: np.ndarray) -> None:
    def kept(**changes: float) -> bool:
        values = f.copy()
        for name, value in changes.items():
            values[chair.names.index(name)] = value
        return bool((chair.relations @ [1.0, *values] >= 0).all())

    assert kept()
    assert kept(leg_width=0.15)
    assert not kept(leg_width=0.26)
    assert kept(leg_depth=0.15)
    assert not kept(leg_depth=0.23)
    assert not kept(back_thickness=0.46)


def test_broken_relations_are_told_as_the_file_writes_them(
    chair: AffineTemplate, f: np.ndarray
) -> None:
    assert chair.broken_relations(f) == []
    legs, back = chair.broken_relations(f * [1, 12, 1, 1, 1, 1, 5, 1])
    assert "seat_depth - 2 * leg_depth" in legs
    assert "seat_depth - back_thickness" in back


def test_parameters_are_given_by_name(chair: AffineTemplate) -> None:
    values = dict(zip(NAMES, np.arange(8.0), strict=True))
    np.testing.assert_array_equal(chair.vector(values), np.arange(8.0))
    with pytest.raises(KeyError):
        chair.vector({"seat_width": 1.0})
    plane = load_template("airplane")
    public = {p.name: 1.0 for p in plane.parameters if not p.nuisance}
    f = dict(zip(plane.names, plane.vector({**public, "wing_sweep": 0.2}), strict=True))
    assert (f["wing_length"], f["wing_sweep"], f["wing_height"]) == (1.0, 0.2, 0.0)
    assert f["wing_root_chord"] == pytest.approx(0.05), "no chord is nothing"


def test_a_variant_keeps_the_relations_of_what_it_has() -> None:
    variants = {variant.variant: variant for variant in load_template("chair").variants}
    base, arms, insets = (
        {name for name, v in variants.items() if any(word in t for t in v.relation_texts)}
        for word in ("base_height", "arm_height", "rear_inset")
    )
    assert base == {"pedestal_chair", "pedestal_armchair"}
    assert arms == {"armchair", "pedestal_armchair"}
    assert insets == {"chair", "armchair"}
    for variant in variants.values():
        assert len(variant.relations) == len(variant.relation_texts)
        assert "seat_depth - back_thickness - back_inset" in variant.relation_texts
