from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from service.absent import differing, idle, negligible
from service.template.affine import AffineTemplate
from service.template.loader import load_template

USUAL = {
    "back_height": 0.42, "back_thickness": 0.04, "seat_thickness": 0.06, "seat_depth": 0.45,
    "seat_width": 0.48, "leg_height": 0.40, "leg_depth": 0.05, "leg_width": 0.05,
}  # fmt: skip


@pytest.fixture(scope="module")
def variants() -> dict[str, AffineTemplate]:
    return {variant.variant: variant for variant in load_template("chair").variants}


def named(template: AffineTemplate, among: np.ndarray) -> set[str]:
    return {name for name, is_in in zip(template.names, among, strict=True) if is_in}


def lacking(template: AffineTemplate, size: float = 1.0, **values: float) -> set[str]:
    lengths = size * template.vector(USUAL | values)
    return named(template, negligible(template, lengths))


@pytest.mark.parametrize("size", [1.0, 100.0, 1e-3])
def test_a_stool_has_no_back_whatever_its_unit(
    variants: dict[str, AffineTemplate], size: float
) -> None:
    chair = variants["chair"]
    assert lacking(chair, size) == set()
    assert lacking(chair, size, back_height=0.02) == {"back_height", "back_thickness"}
    assert lacking(chair, size, back_height=0.1) == set()


def test_what_has_no_legs_has_no_thickness_of_them(variants: dict[str, AffineTemplate]) -> None:
    assert lacking(variants["armchair"], leg_height=0.01) == {
        "leg_height",
        "leg_width",
        "leg_depth",
    }


@pytest.mark.parametrize("name", ["seat_thickness", "back_thickness", "leg_width"])
def test_thin_parts_are_there(variants: dict[str, AffineTemplate], name: str) -> None:
    assert lacking(variants["chair"], **{name: 1e-4}) == set()


def test_a_size_of_every_part_is_never_left_out(variants: dict[str, AffineTemplate]) -> None:
    assert "seat_width" not in lacking(variants["chair"], seat_width=1e-3)


def test_an_airplane_without_wings() -> None:
    airplane = load_template("airplane")
    lengths = np.array([np.mean(p.typical) for p in airplane.parameters])
    assert named(airplane, negligible(airplane, lengths)) == set()
    lengths[airplane.names.index("wing_length")] = 0.0
    assert named(airplane, negligible(airplane, lengths)) == {"wing_length"}


def test_a_column_says_nothing_of_legs(variants: dict[str, AffineTemplate]) -> None:
    def told(one: str, two: str) -> set[str]:
        return named(variants[one], differing(variants[one], variants[two]))

    assert told("chair", "pedestal_chair") == {"leg_width", "leg_depth"}
    assert told("pedestal_armchair", "armchair") == {"leg_width", "leg_depth"}
    assert told("chair", "armchair") == told("pedestal_chair", "pedestal_armchair") == set()


def test_what_moves_nothing_in_a_variant_is_idle(variants: dict[str, AffineTemplate]) -> None:
    pedestal = variants["pedestal_chair"]
    assert named(pedestal, idle(pedestal)) == set()
    jacobian = pedestal.jacobian.copy()
    jacobian[..., pedestal.names.index("leg_width")] = 0.0
    stiff = replace(pedestal, jacobian=jacobian)
    assert named(stiff, idle(stiff)) == {"leg_width"}
    assert "leg_width" not in named(stiff, negligible(stiff, stiff.vector(USUAL)))
