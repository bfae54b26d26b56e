from __future__ import annotations

import numpy as np
import pytest
import trimesh

from service.template.affine import AffineTemplate
from service.template.loader import load_template

PUBLIC = (
    "fuselage_height",
    "fuselage_length",
    "fuselage_width",
    "wing_length",
    "vertical_stabilizer_length",
    "horizontal_stabilizer_length",
)
MIRRORED = ("wing", "horizontal_stabilizer")


@pytest.fixture(scope="module")
def airplane() -> AffineTemplate:
    return load_template("airplane")


@pytest.fixture(scope="module")
def f(airplane: AffineTemplate) -> np.ndarray:
    """A plane with its wings swept back, in the middle of most ranges, and a plain fuselage."""
    values = dict(zip(airplane.names, (airplane.low + airplane.high) / 2, strict=True))
    values |= {
        "fuselage_height": 0.12,
        "fuselage_length": 1.0,
        "fuselage_width": 0.1,
        "wing_length": 0.45,
        "vertical_stabilizer_length": 0.14,
        "horizontal_stabilizer_length": 0.16,
        "wing_root_chord": 0.2,
        "wing_tip_chord": 0.06,
        "wing_sweep": 0.15,
        "wing_position": 0.07,
        "wing_height": -0.03,
        "wing_dihedral": 0.04,
    }
    values |= {name: 0.0 for name in airplane.names if name.startswith(("nose", "tail"))}
    return np.array([values[name] for name in airplane.names])


def own(airplane: AffineTemplate, f: np.ndarray, name: str) -> np.ndarray:
    """The vertices of a part."""
    return airplane.decode(f)[airplane.part == airplane.parts.index(name)]


def test_the_airplane_has_the_papers_counts(airplane: AffineTemplate) -> None:
    assert airplane.base.shape == (2750, 3)
    assert airplane.points == 2750
    assert not airplane.base.any(), "every length is a parameter"
    public = [n for n, shown in zip(airplane.names, airplane.public, strict=True) if shown]
    assert public == list(PUBLIC)
    assert set(airplane.derived) == {"wing_span", "total_length", "total_height"}
    assert next(iter(airplane.anchors)) == "center"


def test_only_nuisance_parameters_are_signed(airplane: AffineTemplate) -> None:
    assert (airplane.low < airplane.high).all()
    assert not (airplane.signed & airplane.public).any()
    assert airplane.signed[airplane.names.index("wing_sweep")]


def test_the_fuselage_is_as_large_as_it_is_said_to_be(
    airplane: AffineTemplate, f: np.ndarray
) -> None:
    body = own(airplane, f, "fuselage")
    np.testing.assert_allclose(np.ptp(body, axis=0), [0.1, 0.12, 1.0])
    np.testing.assert_allclose(body.min(axis=0), -body.max(axis=0), atol=1e-12)
    nose = body[body[:, 2].argmax()]
    np.testing.assert_allclose(nose, [0, 0, 0.5], atol=1e-12)
    assert body[body[:, 2].argmin(), 1] > 0.01, "the tail is swept up"


def test_wings_reach_from_the_fuselage_to_where_they_should(
    airplane: AffineTemplate, f: np.ndarray
) -> None:
    left, right = (own(airplane, f, f"{side}_wing") for side in ("left", "right"))
    # A plane that faces +Z has its left side towards +X.
    assert left[:, 0].min() == pytest.approx(0.025)
    assert left[:, 0].max() == pytest.approx(0.05 + 0.45)
    np.testing.assert_allclose(right, left * [-1, 1, 1])
    for x, chord, y, z in ((0.025, 0.2, -0.03, 0.07), (0.5, 0.06, 0.01, -0.08)):
        section = left[np.isclose(left[:, 0], x)]
        np.testing.assert_allclose(section[:, 2].max(), z + chord / 2)
        np.testing.assert_allclose(section[:, 2].min(), z - chord / 2)
        np.testing.assert_allclose(section[:, 1].mean(), y, atol=1e-12)


def test_stabilizers_stand_out_by_their_lengths(airplane: AffineTemplate, f: np.ndarray) -> None:
    fin = own(airplane, f, "vertical_stabilizer")
    assert fin[:, 1].max() == pytest.approx(0.06 + 0.14)
    np.testing.assert_allclose(fin[:, 0].min(), -fin[:, 0].max())
    plane = own(airplane, f, "left_horizontal_stabilizer")
    assert np.ptp(plane[:, 0]) == pytest.approx(0.16)


def test_what_follows_keeps_its_place_beside_what_leads(
    airplane: AffineTemplate, f: np.ndarray
) -> None:
    names = airplane.names
    height = names.index("horizontal_stabilizer_height")
    fin, body = names.index("vertical_stabilizer_length"), names.index("fuselage_height")

    def after(values: np.ndarray, index: int, factor: float) -> np.ndarray:
        change = np.zeros(len(f))
        change[index] = (factor - 1.0) * values[index]
        return values + airplane.following(values) @ change

    tee = f.copy()
    tee[height] = 0.2 * tee[body] + tee[fin]
    taller = after(tee, fin, 1.5)
    tip = own(airplane, taller, "vertical_stabilizer")[:, 1].max()
    plane = own(airplane, taller, "left_horizontal_stabilizer")[:, 1]
    assert plane.mean() == pytest.approx(tip), "a T-tail stays on top of the fin"
    swept = own(airplane, taller, "left_horizontal_stabilizer")[:, 2].mean()
    gone = swept - own(airplane, tee, "left_horizontal_stabilizer")[:, 2].mean()
    assert gone == pytest.approx(-0.4 * 0.5 * tee[fin]), "and goes back with it"
    low = f.copy()
    low[height] = -0.02
    assert after(low, fin, 1.5)[height] == low[height], "a low one does not sink as the fin grows"


def test_what_is_on_the_fuselage_keeps_its_place_on_it(
    airplane: AffineTemplate, f: np.ndarray
) -> None:
    names = airplane.names
    body, f = names.index("fuselage_height"), f.copy()
    f[[names.index("tail_height"), names.index("tail_rise")]] = -0.03, 0.01
    f[names.index("horizontal_stabilizer_height")] = -0.02
    bigger = f + airplane.following(f) @ (0.5 * f[body] * np.eye(len(f))[body])
    moved = [names[i] for i in np.flatnonzero(bigger != f)]
    proportional = {"fuselage_height", "wing_height", "tail_height", "tail_rise"}
    assert set(moved) == proportional | {"horizontal_stabilizer_height"}
    for name in proportional:
        assert bigger[names.index(name)] == pytest.approx(1.5 * f[names.index(name)])
    before, after = (
        own(airplane, v, "left_horizontal_stabilizer")[:, 1].mean() for v in (f, bigger)
    )
    assert after == pytest.approx(1.5 * before)


def test_the_fuselage_can_taper_to_a_boom_or_end_in_a_nozzle(
    airplane: AffineTemplate, f: np.ndarray
) -> None:
    def widths(**changes: float) -> tuple[float, float]:
        """A quarter of the length from the tail's end, and at the last ring before it."""
        values = f.copy()
        for name, value in changes.items():
            values[airplane.names.index(name)] = value
        body, plain = own(airplane, values, "fuselage"), own(airplane, f, "fuselage")
        z = np.unique(np.round(plain[:, 2], 9))
        at = z[np.abs(z + 0.25).argmin()]
        quarter, last = (body[np.isclose(plain[:, 2], place), 0] for place in (at, z[1]))
        return float(np.ptp(quarter)), float(np.ptp(last))

    plain, boom, nozzle = widths(), widths(tail_width=-0.045), widths(tail_end=0.06)
    assert boom[0] < 0.5 * plain[0]
    assert nozzle[1] > plain[1] + 0.04


def test_every_parameter_moves_something_and_no_two_alike(airplane: AffineTemplate) -> None:
    size = len(airplane.parameters)
    assert np.linalg.matrix_rank(airplane.jacobian.reshape(-1, size)) == size


def test_the_jacobian_is_the_derivative(airplane: AffineTemplate, f: np.ndarray) -> None:
    h = 1e-4
    for index, step in enumerate(h * np.eye(len(f))):
        slope = (airplane.decode(f + step) - airplane.decode(f - step)) / (2 * h)
        np.testing.assert_allclose(slope, airplane.jacobian[:, :, index], atol=1e-10)


def test_every_part_is_closed_and_looks_outwards(airplane: AffineTemplate, f: np.ndarray) -> None:
    vertices = airplane.decode(f)
    for index, name in enumerate(airplane.parts):
        faces = airplane.faces[airplane.part[airplane.faces[:, 0]] == index]
        solid = trimesh.Trimesh(vertices, faces, process=False)
        solid.merge_vertices()
        assert solid.is_watertight, name
        assert solid.volume > 0, name


def test_maps_carry_unit_shapes_to_the_vertices_and_back(
    airplane: AffineTemplate, f: np.ndarray
) -> None:
    vertices = airplane.decode(f)
    unit = airplane.maps(f).unit(vertices)
    mine = unit[np.arange(len(vertices)), airplane.part]
    np.testing.assert_allclose(np.abs(mine).max(axis=0), 0.5, atol=1e-9)
    # What sections add is no part of the maps.
    other = f * np.linspace(0.7, 1.5, len(f))
    placed = airplane.maps(other).place(np.tile(mine[:, None], (1, len(airplane.parts), 1)))
    moved = placed[np.arange(len(vertices)), airplane.part]
    np.testing.assert_allclose(moved, airplane.decode(other), atol=1e-9)


def test_only_the_roots_of_what_stands_in_another_part_are_hidden(
    airplane: AffineTemplate, f: np.ndarray
) -> None:
    vertices = airplane.decode(f)
    part = airplane.part[airplane.faces[:, 0]]
    body = airplane.parts.index("fuselage")
    assert not airplane.hidden[part == body].any()
    centers = vertices[airplane.faces].mean(axis=1)
    for index in range(len(airplane.parts)):
        if index == body:
            continue
        hidden = centers[airplane.hidden & (part == index)]
        assert len(hidden) > 0
        run = airplane.run[index]
        np.testing.assert_allclose(np.ptp(hidden[:, run]), 0.0, atol=1e-12)
        assert np.abs(hidden[:, run]).max() < np.abs(vertices[airplane.part == index][:, run]).max()


def test_the_wing_span_is_the_widest_extent(airplane: AffineTemplate, f: np.ndarray) -> None:
    span, length, height = (airplane.derived[n] for n in airplane.derived)
    assert (span.extent, length.extent, height.extent) == ("x", "z", "y")
    for dimension in (span, length, height):
        assert all(airplane.public[index] for index in dimension.by)


def test_sections_are_no_limit_to_an_edit(airplane: AffineTemplate) -> None:
    told = {
        text for text, own in zip(airplane.relation_texts, airplane.limiting, strict=True) if own
    }
    others = set(airplane.relation_texts) - told
    assert "0.7 * fuselage_width - tail_end" in others
    assert all("tail_" in text or "nose_" in text for text in others)
    assert "wing_root_chord - wing_tip_chord" in told
    assert "0.2 * fuselage_height - tail_rise" in told, "the fin stands on it"
