from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from service.affineedit import move
from service.affineinference import AffineInference
from service.affinetransfer import place, take
from service.encode.model import SHIPPED, load_model
from service.pipeline import infer
from service.requests import EditOptions, InferOptions, TransferOptions, Upload

UPRIGHT = InferOptions("chair", "+y", "+z")
SHIFT = np.array([1.0, 0.25, -2.0])


@pytest.fixture(scope="module")
def found(chair_glb: bytes) -> AffineInference:
    models = {"chair": load_model(SHIPPED / "chair.json")}
    answer = infer(Upload(chair_glb, "chair.glb"), models, UPRIGHT)
    assert isinstance(answer, AffineInference)
    return answer


def other(found: AffineInference, variant: str = "chair", **values: float) -> AffineInference:
    """The same, had another variant, or other lengths in metres, been fitted."""
    fit = found.fit
    lengths = fit.parameters.copy()
    for name, value in values.items():
        lengths[fit.template.names.index(name)] = value * found.scale
    (template,) = (v for v in found.model.template.variants if v.variant == variant)
    fitted = replace(fit, template=template, parameters=lengths)
    return replace(found, candidates=[replace(found.best, estimate=fitted)])


def without(found: AffineInference, name: str) -> AffineInference:
    """The same, had the fitted variant nothing that a parameter moves."""
    template = found.fit.template
    jacobian = template.jacobian.copy()
    jacobian[..., template.names.index(name)] = 0.0
    fit = replace(found.fit, template=replace(template, jacobian=jacobian))
    return replace(found, candidates=[replace(found.best, estimate=fit)])


ALL = TransferOptions()


def test_what_a_variant_has_not_is_left_out_and_told_of(found: AffineInference) -> None:
    for pair, which in (((found, without(found, "leg_width")), "target"),
                        ((without(found, "leg_width"), found), "source")):  # fmt: skip
        taken = take(*pair, ALL, "floor")
        assert len(taken.edits) == 7
        assert "leg_width" not in taken.edits
        (warning,) = taken.warnings
        assert warning == (
            f"leg_width is left out: the {which} is a chair, in which nothing moves by that"
        )
    named = TransferOptions(parameters=("leg_width",))
    taken = take(found, without(found, "leg_width"), named, "floor")
    assert (taken.edits, len(taken.warnings)) == ({}, 1)


def test_a_stools_back_is_left_out(found: AffineInference) -> None:
    stool = other(found, back_height=0.01)
    for pair, which in (((found, stool), "target"), ((stool, found), "source")):
        taken = take(*pair, ALL, "floor")
        assert not {"back_height", "back_thickness"} & set(taken.edits)
        (warning,) = taken.warnings
        assert warning.endswith(f"the {which} has next to nothing of the kind")


def test_the_thickness_of_a_column_is_left_out(found: AffineInference) -> None:
    taken = take(found, other(found, "pedestal_chair", leg_height=0.5), ALL, "floor")
    assert not {"leg_width", "leg_depth"} & set(taken.edits)
    assert taken.edits["leg_height"].amount == pytest.approx(0.5)
    (warning,) = taken.warnings
    assert warning == (
        "leg_depth, leg_width are left out: in a chair and a pedestal chair they are of other parts"
    )


def test_a_reading_without_arms_and_one_with_them_share_all(found: AffineInference) -> None:
    taken = take(found, other(found, "armchair", seat_width=0.6), ALL, "floor")
    assert taken.warnings == []
    assert len(taken.edits) == 8


def test_beside_a_stool_a_chair_counts_without_its_back(found: AffineInference) -> None:
    options = TransferOptions(size="source")
    stool = other(found, back_height=0.01)
    assert take(found, stool, options, "floor").scale == pytest.approx(1.0)
    assert take(stool, found, options, "floor").scale == pytest.approx(1.0)
    small = other(found, **{
        name: 0.5 * value
        for name, value in zip(found.fit.template.names, found.parameters.tolist(), strict=True)
    })  # fmt: skip
    taken = take(found, small, options, "floor")
    assert taken.scale == pytest.approx(2.0, rel=1e-6)
    assert taken.edits["seat_width"].amount == pytest.approx(2.0 * taken.values["seat_width"])


def test_the_target_is_named_by_what_is_told_of_it(found: AffineInference) -> None:
    wider = other(found, seat_width=0.6)
    options = TransferOptions(parameters=("seat_width", "seat_top_height"))
    taken = take(found, wider, options, "floor")
    report = wider.derived_report() | wider.parameter_report()
    for name, value in taken.values.items():
        assert value == report[name]["value"]
        assert taken.edits[name].amount == pytest.approx(value)


@pytest.mark.parametrize("keep", ["floor", "seat", "center"])
def test_the_kept_point_comes_to_its_goal(
    found: AffineInference, box_chair: trimesh.Trimesh, keep: str
) -> None:
    away = trimesh.Trimesh(box_chair.vertices + SHIFT, box_chair.faces, process=False)
    upload = Upload(bytes(away.export(file_type="glb")), "away.glb")
    there = infer(upload, {"chair": found.model}, UPRIGHT)
    assert isinstance(there, AffineInference)
    taken = take(found, there, TransferOptions(position="target", parameters=("leg_width",)), keep)
    assert taken.goal is not None
    stays = move(found, {}, EditOptions(), keep)
    moved = place(stays, taken.goal, keep)
    shift = moved.vertices - found.mesh.vertices
    np.testing.assert_allclose(shift, np.broadcast_to(SHIFT, shift.shape), atol=1e-4)
    assert place(stays, None, keep) is stays
