from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from service.template.parts import Part, PartError, homogeneous, read_parts

NAMES = ("length", "chord", "sweep")
WING: dict[str, Any] = {
    "shape": "panel",
    "cells": [2, 4],
    "start": {"center": [0.1, 0, "chord / 4"], "size": ["chord / 10", "chord"]},
    "end": {"center": ["0.1 + length", 0.02, "chord / 4 - sweep"], "size": [0.01, "chord / 2"]},
}
VALUES = np.array([1.0, 2.0, 0.4, 0.3])
"""A one for the constants, then length, chord and sweep."""


def at(part: Part) -> np.ndarray:
    return part.vertices() @ VALUES


def test_a_part_between_two_sections_has_them_at_its_ends() -> None:
    (wing,) = read_parts("wing", WING, NAMES)
    vertices, unit = at(wing), wing.shape.vertices
    root, tip = (vertices[unit[:, 0] == end] for end in (-0.5, 0.5))
    np.testing.assert_allclose(root.min(axis=0), [0.1, -0.02, -0.1], atol=1e-15)
    np.testing.assert_allclose(root.max(axis=0), [0.1, 0.02, 0.3], atol=1e-15)
    np.testing.assert_allclose(tip.min(axis=0), [2.1, 0.015, -0.3], atol=1e-15)
    np.testing.assert_allclose(tip.max(axis=0), [2.1, 0.025, -0.1], atol=1e-15)
    middle = vertices[unit[:, 0] == 0]
    np.testing.assert_allclose(np.ptp(middle[:, 2]), 0.3)


@pytest.mark.parametrize(("along", "across"), [("x", [1, 2]), ("y", [0, 2]), ("z", [0, 1])])
def test_sizes_of_sections_are_in_the_order_of_the_axes(along: str, across: list[int]) -> None:
    entry = {
        "shape": "tube",
        "cells": [8, 2],
        "along": along,
        "start": {"center": [0, 0, 0], "size": [0.2, 0.4]},
        "end": {"center": [float(axis == along) for axis in "xyz"], "size": [0.6, 0.8]},
    }
    (tube,) = read_parts("tube", entry, ())
    vertices = tube.vertices()[..., 0]
    run = "xyz".index(along)
    for end, size in ((0.0, [0.2, 0.4]), (1.0, [0.6, 0.8])):
        section = vertices[vertices[:, run] == end]
        np.testing.assert_allclose(np.ptp(section[:, across], axis=0), size)


def test_a_fin_mirrored_across_the_middle_still_looks_outwards() -> None:
    entry = WING | {"mirror": {"other": "x"}, "hidden": ["start"]}
    wing, other = read_parts("wing", entry, NAMES)
    assert (wing.name, other.name) == ("wing", "other")
    np.testing.assert_allclose(at(other), at(wing) * [-1, 1, 1])
    assert np.array_equal(wing.hidden, other.hidden)
    assert wing.hidden.sum() == (wing.shape.side == 0).sum() > 0
    for part in (wing, other):
        a, b, c = np.moveaxis(at(part)[part.shape.faces], 1, 0)
        assert np.einsum("fc,fc->f", a, np.cross(b, c)).sum() / 6 > 0.01, "its volume"


def test_every_coordinate_stays_affine_in_the_parameters() -> None:
    (wing,) = read_parts("wing", WING, NAMES)
    rows = wing.vertices()
    assert rows.shape == (len(wing.shape.vertices), 3, 4)
    chord = rows[..., 2]
    assert np.ptp(chord[:, 2]) > 0, "the chord moves leading and trailing edge apart"
    np.testing.assert_allclose(rows[..., 3][:, 2], -(wing.shape.vertices[:, 0] + 0.5))


def test_homogeneous_points_end_in_one() -> None:
    assert homogeneous(np.array([[2.0, 3.0, 4.0]])).tolist() == [[2, 3, 4, 1]]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"shape": "sphere"}, "part 'wing': no shape is named 'sphere'"),
        ({"cells": [4]}, "part 'wing': cells of a panel"),
        ({"along": "up"}, "part 'wing': along 'up' is no axis"),
        ({"hidden": ["root"]}, "part 'wing': no side is named 'root'"),
    ],
)
def test_what_makes_no_part_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(PartError, match=message):
        read_parts("wing", WING | change, NAMES)
