from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import service
from service.affineedit import move
from service.affineinference import AffineInference
from service.constraints import Interval
from service.edited import Moved
from service.edits import Change
from service.encode.model import load_models
from service.errors import InvalidRequest
from service.pipeline import infer
from service.requests import EditOptions, InferOptions, Upload


@pytest.fixture(scope="module")
def found(chair_glb: bytes) -> AffineInference:
    models = load_models(Path(service.__file__).parent / "models")
    answer = infer(Upload(chair_glb, "chair.glb"), models, InferOptions(up="+y", front="+z"))
    assert isinstance(answer, AffineInference)
    return answer


def misread(found: AffineInference, share: float) -> AffineInference:
    """The same, had the fit read the legs so much shorter, and put their feet above the floor."""
    estimate = found.fit
    f = estimate.parameters.copy()
    f[estimate.template.names.index("leg_height")] *= 1.0 - share
    candidate = replace(found.best, estimate=replace(estimate, parameters=f))
    return replace(found, candidates=[candidate])


def seat(moved: Moved) -> tuple[float, float]:
    """The seat's height of the box chair, told and on the mesh: its top is at 0.46."""
    told = {shift.name: shift.after for shift in (*moved.parameters, *moved.derived)}
    assert told["seat_top_height"] == pytest.approx(told["leg_height"] + told["seat_thickness"])
    before, after = moved.found.mesh.vertices[:, 1], moved.vertices[:, 1]
    middle = np.linalg.norm(moved.found.mesh.vertices[:, [0, 2]], axis=1) < 0.1
    top = middle & (np.abs(before - 0.46) < 1e-6)
    assert top.any()
    return told["seat_top_height"], float(after[top].mean() - after.min())


def edit(found: AffineInference, mode: str = "blend", **edits: float | Change) -> Moved:
    changes = {n: c if isinstance(c, Change) else Change("set", c) for n, c in edits.items()}
    return move(found, changes, EditOptions(mode=mode), "floor")


@pytest.mark.parametrize("mode", ["blend", "paper"])
@pytest.mark.parametrize("share", [0.0, 0.1, 0.2])
def test_a_seat_is_as_high_as_it_is_set_whatever_the_fit_is_off(
    found: AffineInference, share: float, mode: str
) -> None:
    told, had = seat(edit(misread(found, share), mode, seat_top_height=0.5))
    assert told == pytest.approx(0.5)
    assert had == pytest.approx(0.5, rel=1e-4)


def test_relative_changes_start_from_what_was_told(found: AffineInference) -> None:
    off = misread(found, 0.1)
    value = off.dimensions().derived(off.parameters)["seat_top_height"]
    told, had = seat(edit(off, seat_top_height=Change("add", 0.05)))
    assert (told, had) == (pytest.approx(value + 0.05), pytest.approx(0.51, rel=1e-4))
    still = edit(off, seat_top_height=value)
    np.testing.assert_array_equal(still.vertices, off.mesh.vertices)


def test_how_far_the_fit_is_off_is_told(found: AffineInference) -> None:
    def warned(share: float) -> list[str]:
        return [w for w in edit(misread(found, share), seat_top_height=0.5).warnings if "seat" in w]

    assert warned(0.0) == []
    (by_mesh,) = warned(0.2)
    assert by_mesh.startswith("seat_top_height is 0.46 m on the mesh before the edit, and 0.3")
    assert by_mesh.endswith("the edit goes by the mesh")
    assert any(text.endswith("the edit goes by the fit") for text in warned(0.5))


def test_dimensions_are_the_meshs_own_before_and_after(found: AffineInference) -> None:
    dimensions = {d.name: d for d in edit(misread(found, 0.1), seat_top_height=0.5).dimensions}
    height = dimensions["seat_top_height"]
    assert (height.before, height.after) == (pytest.approx(0.46), pytest.approx(0.5))
    assert height.asked == Interval(0.5, 0.5)
    assert dimensions["total_width"].before == pytest.approx(0.48, abs=1e-6)
    assert dimensions["total_width"].asked is None
    assert height.report()["asked"] == {"set": 0.5}


def test_conflicts_are_in_the_unit_of_the_answer(found: AffineInference) -> None:
    with pytest.raises(InvalidRequest) as caught:
        move(
            found, {}, EditOptions(), "floor",
            {"total_width": Interval(high=0.4), "seat_width": Interval(low=0.6)},
        )  # fmt: skip
    assert caught.value.code == "constraints_conflict"
    assert {entry["unit"] for entry in caught.value.members["conflicts"]} == {"m"}
