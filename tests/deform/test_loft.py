from __future__ import annotations

import numpy as np
import pytest
from boxes import ORIGIN, PARAMETERS, chair
from planes import VALUES, airplane, on_wing, plane_values

from service.deform.loft import Loft, lofts
from service.template.affine import AffineTemplate
from service.template.loader import compile_template

STARTS = np.full(6, -0.5)


def planes_lofts(starts: np.ndarray = STARTS) -> dict[int, Loft]:
    maps = airplane().maps(plane_values())
    return lofts(airplane(), plane_values(), maps.frames, maps.tapers, starts)


def distance(part: str, x: np.ndarray) -> float:
    loft = planes_lofts()[airplane().parts.index(part)]
    return float(loft.distance(loft.unit(x[None]))[0])


def legs(shape: str) -> AffineTemplate:
    """One tapering post of a box or a tube."""
    size = ["width", "width"]
    part = {
        "shape": shape,
        "cells": [4, 4, 4] if shape == "box" else [8, 4],
        "start": {"center": [0, 0, 0], "size": size},
        "end": {"center": [0, "height", 0], "size": ["width / 2", "width / 2"]},
    }
    entry = {"label": "", "group": "", "range": [0.1, 1.0]}
    return compile_template(
        {
            "name": "post", "label": "Post", "points": 100,
            "parameters": {"width": entry, "height": entry},
            "parts": {"post": part}, "keep": {"floor": [0, 0, 0]},
        }
    )  # fmt: skip


def test_boxes_are_none_and_every_part_of_an_airplane_is_one():
    frames = chair().maps(PARAMETERS)
    assert not lofts(chair(), PARAMETERS, frames.frames, frames.tapers, STARTS)
    found = planes_lofts()
    assert list(found) == list(range(6))
    assert [loft.tapered for loft in found.values()] == [False] + 5 * [True]


def test_unit_coordinates_are_the_templates():
    x = on_wing("left_wing", 0.4, 0.2, -0.3)
    u = planes_lofts()[1].unit(x[None])[0]
    np.testing.assert_allclose(u[1:], [0.2, -0.3], atol=1e-5)
    np.testing.assert_allclose(
        airplane().maps(plane_values()).place(np.tile(u, (1, 6, 1)))[0, 1], x, atol=1e-6
    )


def test_the_skin_is_at_no_distance():
    vertices = airplane().decode(plane_values())
    for part, loft in planes_lofts().items():
        own = vertices[airplane().part == part]
        assert loft.distance(loft.unit(own)).max() < 0.004, airplane().parts[part]


def test_above_beside_and_beyond_a_fuselage():
    width, height, length = (VALUES[f"fuselage_{n}"] for n in ("width", "height", "length"))
    z = 0.3 * length
    widest = np.array([0.0, 0.0, 0.5 * length - 0.18 * length])
    beside = widest + np.array([width / 2 + 0.05, 0, 0])
    assert distance("fuselage", beside) == pytest.approx(0.05, abs=1e-5)
    above = widest + np.array([0, height / 2 + 0.05, 0])
    assert distance("fuselage", above) == pytest.approx(0.05, abs=1e-5)
    assert distance("fuselage", np.array([0.0, 0.0, length / 2 + 0.07])) == pytest.approx(0.07)
    assert distance("fuselage", np.array([0.0, 0.0, z])) == 0.0
    # A corner of the bounding box is off a round body.
    corner = widest + np.array([width / 2, height / 2, 0])
    assert distance("fuselage", corner) == pytest.approx(0.414 * (width + height) / 4, rel=0.1)


@pytest.mark.parametrize("span", [0.0, 0.5, 1.0])
def test_above_and_ahead_of_a_wing_that_tapers(span):
    thick = on_wing("left_wing", span, 0.5, 0.0) + np.array([0.0, 0.04, 0.0])
    assert distance("left_wing", thick) == pytest.approx(0.04, rel=0.02)
    ahead = on_wing("left_wing", span, 0.0, 0.5) + np.array([0.0, 0.0, 0.04])
    swept = VALUES["wing_sweep"] / (VALUES["wing_length"] + VALUES["fuselage_width"] / 4)
    assert distance("left_wing", ahead) == pytest.approx(0.04 / np.hypot(1, swept), rel=0.1)


def test_behind_and_above_a_flat_wing_it_is_as_far_as_it_is():
    trailing = on_wing("left_wing", 0.1, 0.0, -0.5)
    behind = distance("left_wing", trailing + np.array([0.0, 0.04, -0.12]))
    assert behind == pytest.approx(np.hypot(0.04, 0.12), rel=0.1)


def test_off_a_tapered_box_the_distance_is_to_its_section():
    template, f = legs("box"), np.array([0.2, 0.8])
    loft = lofts(template, f, *_maps(template, f), STARTS[:1])[0]
    assert loft.outline is None
    # Half way up it is 0.15 wide.
    x = np.array([[0.075 + 0.03, 0.4, 0.075 + 0.04], [0.0, 0.9, 0.0]])
    np.testing.assert_allclose(loft.distance(loft.unit(x)), [0.05, 0.1], rtol=1e-4)
    tube = legs("tube")
    assert lofts(tube, f, *_maps(tube, f), STARTS[:1])[0].outline is not None


def test_a_part_that_begins_later_has_the_rest_of_the_outline():
    whole, later = planes_lofts()[0].outline, planes_lofts(np.array([0.0, *STARTS[1:]]))[0].outline
    at = np.array([0.1, 0.3], np.float32)
    np.testing.assert_allclose(later.at(2 * at - 0.5)[1], whole.at(at)[1], atol=1e-6)


def test_nothing_is_nan_far_away_or_on_the_axis():
    x = np.concatenate([np.zeros((1, 3)), 3.0 * np.eye(3), -3.0 * np.eye(3), [ORIGIN]])
    for loft in planes_lofts().values():
        assert np.isfinite(loft.distance(loft.unit(x))).all()


def _maps(template: AffineTemplate, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    maps = template.maps(f)
    return maps.frames, maps.tapers


def test_a_fuselage_that_swells_is_seen_as_it_is():
    template, f = airplane(), plane_values()
    slim = f.copy()
    slim[template.names.index("tail_width")] = -0.03
    maps = template.maps(slim)
    narrow = lofts(template, slim, maps.frames, maps.tapers, STARTS)[0].outline
    s = np.array([-0.28, 0.15], np.float32)
    (thin, same), (thick, other) = narrow.at(s)[1][:, 0], planes_lofts()[0].outline.at(s)[1][:, 0]
    assert thick - thin == pytest.approx(0.5 * 0.03 / VALUES["fuselage_width"], rel=0.1)
    assert same == pytest.approx(other)
