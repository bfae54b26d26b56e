from __future__ import annotations

import numpy as np
import pytest

from service.template.affine import AffineTemplate
from service.template.loader import load_template

VALUES = {
    "back_height": 0.42,
    "back_thickness": 0.04,
    "seat_thickness": 0.06,
    "seat_depth": 0.45,
    "seat_width": 0.50,
    "leg_height": 0.38,
    "leg_depth": 0.05,
    "leg_width": 0.03,
}


@pytest.fixture(scope="module")
def chair() -> AffineTemplate:
    return load_template("chair")


def box(template: AffineTemplate, f: np.ndarray, part: str) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner of a part's bounding box."""
    vertices = template.decode(f)[template.part == template.parts.index(part)]
    return vertices.min(axis=0), vertices.max(axis=0)


def test_users_see_the_papers_eight_parameters_and_no_others(chair: AffineTemplate) -> None:
    names = np.array(chair.names)
    assert names[chair.public].tolist() == list(VALUES)
    assert chair.names[:8] == tuple(VALUES)
    assert set(chair.derived) == {"seat_top_height", "total_height", "total_width", "total_depth"}
    assert not chair.base.any(), "every length is a parameter"


def test_the_usual_variant_upright_is_the_papers_chair(chair: AffineTemplate) -> None:
    paper, usual = load_template("paper_chair"), chair.variants[0]
    assert (usual.variant, len(usual.base)) == ("chair", 2840)
    assert set(usual.parts) == set(paper.parts)
    f = chair.vector(VALUES)
    g = paper.vector(VALUES)
    for part in paper.parts:
        np.testing.assert_allclose(box(usual, f, part), box(paper, g, part), atol=1e-12)


def test_variants_differ_in_their_arms_and_in_what_they_stand_on(chair: AffineTemplate) -> None:
    arms, legs = {"left_arm", "right_arm"}, {f"{a}_{b}_leg" for a in ("front", "rear")
                                            for b in ("left", "right")}  # fmt: skip
    expected = {
        "chair": legs,
        "armchair": legs | arms,
        "pedestal_chair": {"column", "foot"},
        "pedestal_armchair": {"column", "foot"} | arms,
    }
    found = {own.variant: set(own.parts) - {"seat", "back"} for own in chair.variants}
    assert found == expected
    for own in chair.variants:
        assert own.active[:8].all(), "every public parameter moves something"


def test_boxes_lean_taper_and_stand_where_they_are_said_to(chair: AffineTemplate) -> None:
    own = chair.variants[1]
    plain = chair.vector(VALUES)
    nuisances = {
        "back_recline": 0.1, "leg_splay": 0.04, "rear_splay": 0.06, "leg_inset": 0.02,
        "seat_taper": 0.08, "arm_height": 0.2, "arm_width": 0.05, "arm_gap": 0.01,
    }  # fmt: skip
    f = chair.vector({**VALUES, **nuisances})
    assert box(own, f, "back")[0][2] == pytest.approx(box(own, plain, "back")[0][2] - 0.1)
    assert box(own, f, "back")[1][2] == pytest.approx(box(own, plain, "back")[1][2])
    right = box(own, f, "front_right_leg")
    assert right[0][0] == pytest.approx(-0.25 + 0.02 - 0.04)
    assert box(own, f, "rear_right_leg")[0][2] == pytest.approx(-0.225 - 0.06)
    seat = own.decode(f)[own.part == own.parts.index("seat")]
    assert np.ptp(seat[np.isclose(seat[:, 2], 0.225), 0]) == pytest.approx(0.5)
    assert np.ptp(seat[np.isclose(seat[:, 2], -0.225), 0]) == pytest.approx(0.42)
    arm = box(own, f, "left_arm")
    assert arm[1][1] == pytest.approx(0.03 + 0.2)
    assert (arm[0][0], arm[1][0]) == (pytest.approx(0.26), pytest.approx(0.31))


def test_a_pedestal_is_as_thick_as_legs_are_said_to_be(chair: AffineTemplate) -> None:
    own = chair.variants[2]
    f = chair.vector({**VALUES, "base_width": 0.4, "base_height": 0.03})
    low, high = box(own, f, "column")
    np.testing.assert_allclose(high - low, [0.03, 0.38, 0.05])
    low, high = box(own, f, "foot")
    np.testing.assert_allclose(high - low, [0.4, 0.03, 0.4])
    assert low[1] == pytest.approx(-0.03 - 0.38)
