from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from service.template.expressions import ExpressionError
from service.template.parts import PartError, read_parts
from service.template.rounds import fuselage

NAMES = ("length", "belly", "lift")
TUBE: dict[str, Any] = {
    "shape": "tube",
    "cells": [8, 8],
    "along": "z",
    "center": [0, 0, 0],
    "size": [1, 1, "length"],
    "sections": [
        {"at": -0.5},
        {"at": 0, "grow": ["belly", 0], "shift": [0, "lift"]},
        {"at": 0.25},
    ],
}
VALUES = np.array([1.0, 4.0, 0.5, 0.2])
"""A one for the constants, then length, belly and lift."""


def section(at: float, entry: dict[str, Any] = TUBE) -> np.ndarray:
    """Vertices ``[n, 3]`` of the tube there."""
    (part,) = read_parts("tube", entry, NAMES)
    return (part.vertices() @ VALUES)[np.isclose(part.shape.vertices[:, 2], at)]


def test_a_section_grows_and_shifts() -> None:
    middle = section(0.0)
    np.testing.assert_allclose(np.ptp(middle[:, 0]), 1.5)
    np.testing.assert_allclose(np.ptp(middle[:, 1]), 1.0)
    np.testing.assert_allclose([middle[:, 1].min(), middle[:, 1].max()], [-0.3, 0.7])
    np.testing.assert_allclose(middle[:, 2], 0.0, atol=1e-15)


@pytest.mark.parametrize(
    ("at", "share"), [(-0.5, 0), (-0.25, 0.5), (-0.125, 0.75), (0.125, 0.5), (0.25, 0), (0.5, 0)]
)
def test_between_sections_it_passes_evenly(at: float, share: float) -> None:
    own = section(at)
    np.testing.assert_allclose(np.ptp(own[:, 0]), 1.0 + 0.5 * share)
    np.testing.assert_allclose(own[:, 1].max(), 0.5 + 0.2 * share)


def test_a_point_shifts_and_does_not_grow() -> None:
    unit = fuselage((8, 12), 0.2, 0.4)
    entry = {
        "shape": "fuselage", "cells": [8, 12], "nose": 0.2, "tail": 0.4,
        "center": [0, 0, 0], "size": [1, 1, "length"],
        "sections": [{"at": -0.5, "grow": ["belly", "belly"], "shift": [0, "lift"]}, {"at": 0}],
    }  # fmt: skip
    (part,) = read_parts("hull", entry, NAMES)
    vertices = part.vertices() @ VALUES
    tail = vertices[unit.vertices[:, 2] == -0.5]
    np.testing.assert_allclose(tail, [[0.0, 0.2, -2.0]])
    rings = np.unique(unit.vertices[:, 2])
    first = vertices[unit.vertices[:, 2] == rings[1]]
    assert np.ptp(first[:, 0]) > 0.4, "the end is blunt"


def test_mirrored_copies_swell_as_mirrored() -> None:
    tube, other = read_parts("tube", TUBE | {"mirror": {"other": "y"}}, NAMES)
    np.testing.assert_allclose(other.vertices(), tube.vertices() * [[[1], [-1], [1]]])


@pytest.mark.parametrize(
    ("sections", "message"),
    [
        ([], "ascending"),
        ([{"at": 0.2}, {"at": 0.1}], "ascending"),
        ([{"at": -0.7}], "ascending"),
        ([{"at": 0, "grow": ["belly"]}], "two lengths"),
    ],
)
def test_sections_that_make_no_sense_are_named(sections: Any, message: str) -> None:
    with pytest.raises(PartError, match=f"'tube'.*{message}"):
        read_parts("tube", TUBE | {"sections": sections}, NAMES)


def test_lengths_of_sections_are_affine() -> None:
    sections = [{"at": 0, "grow": ["belly * lift", 0]}]
    with pytest.raises(ExpressionError):
        read_parts("tube", TUBE | {"sections": sections}, NAMES)
