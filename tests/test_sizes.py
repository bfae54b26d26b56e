from __future__ import annotations

import numpy as np
import pytest
from plain_chair import PLAIN

from service.sizes import size_ratio, size_warning, stature_warning
from service.template.affine import AffineTemplate
from service.template.loader import load_template

VALUES = np.array(list(PLAIN.values()))


@pytest.fixture(scope="module")
def chair() -> AffineTemplate:
    return load_template("paper_chair")


@pytest.mark.parametrize("scale", [0.3, 1.0, 2.5])
def test_chairs_of_sensible_sizes_are_passed_over(chair: AffineTemplate, scale: float) -> None:
    assert size_ratio(chair, VALUES * scale) == pytest.approx(scale, rel=0.2)
    assert size_warning(chair, VALUES * scale, "obj", "m") is None
    assert size_warning(chair, VALUES * scale, "glb", "cm") is None


@pytest.mark.parametrize(
    ("scale", "unit", "likely"),
    [(1000, "m", "mm"), (100, "m", "cm"), (39.4, "m", "in"), (0.01, "cm", "m"), (10, "cm", "mm")],
)
def test_the_likelier_unit_is_named(
    chair: AffineTemplate, scale: float, unit: str, likely: str
) -> None:
    warning = size_warning(chair, VALUES * scale, "obj", unit)
    assert warning is not None
    word = "inches" if likely == "in" else likely
    assert warning.endswith(f"it seems to be in {word}: say units={likely}")
    assert f"with {unit} as the unit" in warning
    assert "e+" not in warning


def test_gltf_is_in_metres_whatever_the_client_says(chair: AffineTemplate) -> None:
    warning = size_warning(chair, VALUES * 100, "glb", "cm")
    assert warning is not None
    assert warning.endswith("it seems to be in cm, but its format's unit is the metre")
    assert "with metres as the unit" in warning


def test_a_size_that_no_unit_explains_is_told(chair: AffineTemplate) -> None:
    for scale in (1e-6, 1e6):
        warning = size_warning(chair, VALUES * scale, "ply", "m")
        assert warning is not None
        assert "arbitrary" in warning


def test_signed_and_nuisance_parameters_say_nothing_of_size() -> None:
    airplane = load_template("airplane")
    middle = np.array([(p.typical[0] * p.typical[1]) ** 0.5 if p.low > 0 else 0.0
                       for p in airplane.parameters])  # fmt: skip
    assert size_ratio(airplane, middle) == pytest.approx(1.0)
    moved = np.where(airplane.public, middle, -100.0)
    assert size_ratio(airplane, moved) == pytest.approx(1.0)


@pytest.mark.parametrize("metres", [1.25, 1.7, 2.2])
def test_grown_people_are_passed_over(metres: float) -> None:
    assert stature_warning("human", metres, "obj", "m") is None


@pytest.mark.parametrize(
    ("metres", "unit", "likely"), [(175, "m", "cm"), (0.0175, "cm", "m"), (5.6, "m", "ft")]
)
def test_a_persons_unit_is_guessed(metres: float, unit: str, likely: str) -> None:
    warning = stature_warning("human", metres, "obj", unit)
    assert warning is not None
    word = {"in": "inches", "ft": "feet"}.get(likely, likely)
    assert warning.endswith(f"it seems to be in {word}: say units={likely}")


def test_who_is_small_may_be_a_child() -> None:
    small, tiny = (stature_warning("human", metres, "glb", "m") for metres in (1.0, 0.2))
    assert small is not None
    assert tiny is not None
    assert "a human of this size would be 0.61 times as large as usual" in small
    assert "child" in small
    assert "child" not in tiny
