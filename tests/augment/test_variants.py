"""Variants of one upload."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from service import pipeline
from service.augment.options import AugmentOptions
from service.augment.validity import Limits
from service.augment.variants import Source, variants
from service.encode.model import Model
from service.errors import InvalidRequest
from service.mesh.formats import read_mesh
from service.requests import EditOptions, InferOptions, Upload

OPTIONS = AugmentOptions(count=6, seed=4)


def test_each_is_what_edit_answers_for_its_edits(
    chair_source: Source, chair_glb: bytes, models: Mapping[str, Model]
) -> None:
    upload, options = Upload(chair_glb, "chair.glb"), InferOptions(category="chair")
    made = [variant for variant in chair_source.variants(OPTIONS) if variant.edited]
    assert len(made) > 3
    for variant in made[:3]:
        edited = pipeline.edit(upload, models, options, variant.edits, EditOptions())
        assert variant.edited == edited
        assert variant.row()["parameters"]["seat_width"]["value"] == edited.parameters["seat_width"]


def test_a_variant_is_the_same_whatever_is_made_before_it(
    chair_source: Source, chair_glb: bytes, models: Mapping[str, Model]
) -> None:
    all_of_them = [variant.sha256 for variant in chair_source.variants(OPTIONS)]
    assert len(set(all_of_them)) == len(all_of_them)
    upload, options = Upload(chair_glb, "chair.glb"), InferOptions(category="chair")
    fewer = replace(OPTIONS, count=5)
    rest = variants(upload, models, options, EditOptions(), fewer, begin=3)
    found = [(variant.index, variant.sha256) for variant in rest]
    assert found == [(3, all_of_them[3]), (4, all_of_them[4])]


def test_another_seed_makes_others(chair_source: Source) -> None:
    one, other = (
        [v.sha256 for v in chair_source.variants(AugmentOptions(3, seed))] for seed in (1, 2)
    )
    assert not set(one) & set(other)


def test_without_strength_nothing_changes(chair_source: Source, chair_glb: bytes) -> None:
    (variant,) = chair_source.variants(AugmentOptions(1, 3, 0.0))
    assert variant.edited is not None
    before = read_mesh(chair_glb, "chair.glb").vertices
    after = read_mesh(variant.edited.data, "chair.glb").vertices
    np.testing.assert_allclose(after, before, atol=1e-5)


def test_strength_makes_them_differ_more(chair_source: Source) -> None:
    found = chair_source.found
    before = found.parameters[found.model.template.names.index("seat_depth")]

    def spread(strength: float) -> float:
        made = chair_source.variants(AugmentOptions(12, 1, strength))
        after = [v.edited.parameters["seat_depth"] for v in made if v.edited]
        return float(np.abs(np.log(np.array(after) / before)).mean())

    assert spread(0.2) < spread(1.0)


def test_what_no_draw_leaves_whole_is_rejected_with_the_reason(chair_source: Source) -> None:
    strict = replace(chair_source, limits=Limits(flips=-1.0))
    variant = strict.variant(OPTIONS, 0)
    assert variant.status == "rejected"
    assert variant.edited is None
    assert variant.problem is not None
    assert variant.problem.code == "variant_damaged"
    row = variant.row()
    assert row["problem"]["code"] == "variant_damaged"
    assert row["file"] is None
    assert row["validity"]["flipped_faces"] == 0


def test_a_row_is_json_and_says_where_the_variant_comes_from(chair_source: Source) -> None:
    row = json.loads(json.dumps(chair_source.variant(OPTIONS, 2).row()))
    assert (row["index"], row["file"], row["format"]) == (2, "002.glb", "glb")
    facts = row["provenance"]
    assert facts["mesh_id"] == chair_source.found.upload.mesh_id
    assert (facts["seed"], facts["index"], facts["category"]) == (4, 2, "chair")
    assert facts["drawn_from"] == "real shapes"
    assert set(row["validity"]) >= {"flipped_faces", "opened_gaps"}


@pytest.mark.parametrize(
    ("options", "code"),
    [
        (AugmentOptions(0), "count_out_of_range"),
        (AugmentOptions(1001), "count_out_of_range"),
        (AugmentOptions(1, -1), "seed_out_of_range"),
        (AugmentOptions(1, 0, 1.5), "strength_out_of_range"),
        (AugmentOptions(1, 0, float("nan")), "strength_out_of_range"),
    ],
)
def test_options_that_make_no_sense_are_told_of(options: AugmentOptions, code: str) -> None:
    with pytest.raises(InvalidRequest) as caught:
        options.require_sound()
    assert caught.value.code == code


def test_a_wrong_option_of_the_edit_is_an_error_of_all(
    chair_glb: bytes, models: Mapping[str, Model]
) -> None:
    upload, options = Upload(chair_glb, "chair.glb"), InferOptions(category="chair")
    made = variants(upload, models, options, EditOptions(keep="nose"), AugmentOptions(2))
    with pytest.raises(InvalidRequest) as caught:
        next(made)
    assert caught.value.code == "unknown_keep"
