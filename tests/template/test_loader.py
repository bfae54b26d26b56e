from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from service.template.affine import AffineTemplate
from service.template.loader import TemplateError, compile_template, load_template

SPEC: dict[str, Any] = {
    "name": "table",
    "label": "Table",
    "points": 500,
    "parameters": {
        "width": {"label": "Width", "group": "top", "range": [0.5, 2.0], "typical": [0.8, 1.6]},
        "height": {"label": "Leg height", "group": "legs", "paper": "leg", "range": [0.3, 1]},
    },
    "relations": ["width - height / 4", "height - 0.4"],
    "parts": {
        "top": {
            "shape": "box",
            "cells": [3, 1, 2],
            "center": [0, 0, 0],
            "size": ["width", 0.05, "width / 2"],
        },
        "leg": {
            "shape": "box",
            "cells": [1, 2, 1],
            "center": ["width / 2 - 0.05", "-height / 2 - 0.025", "width / 4 - 0.05"],
            "size": [0.1, "height", 0.1],
            "hidden": ["top"],
            "mirror": {"left_leg": "x", "rear_left_leg": "xz"},
        },
    },
    "derived": {
        "total": {
            "label": "Total height",
            "group": "all",
            "value": "height + 0.05",
            "by": ["height"],
            "typical": [0.3, 1.2],
        },
        "length": {
            "label": "Length",
            "group": "all",
            "extent": "x",
            "by": ["width", "height"],
            "typical": [0.5, 2],
        },
    },
    "keep": {"floor": [0, "-height - 0.025", 0]},
}


def changed(path: str, value: Any) -> dict[str, Any]:
    """The specification with one entry replaced, or removed by None."""
    spec = copy.deepcopy(SPEC)
    *outer, last = path.split(".")
    entry = spec
    for name in outer:
        entry = entry[name]
    if value is None:
        del entry[last]
    else:
        entry[last] = value
    return spec


@pytest.fixture(scope="module")
def table() -> AffineTemplate:
    return compile_template(SPEC)


def test_a_file_compiles_to_its_template(tmp_path: Path, table: AffineTemplate) -> None:
    path = tmp_path / "table.yaml"
    path.write_text(yaml.safe_dump(SPEC, sort_keys=False), "utf-8")
    for source in (path, str(path)):
        loaded = load_template(source)
        assert (loaded.name, loaded.label, loaded.points) == ("table", "Table", 500)
        assert loaded.names == ("width", "height")
        np.testing.assert_array_equal(loaded.jacobian, table.jacobian)
        np.testing.assert_array_equal(loaded.base, table.base)


def test_parameters_keep_what_the_file_says(table: AffineTemplate) -> None:
    width, height = table.parameters
    assert (width.label, width.group, width.low, width.high) == ("Width", "top", 0.5, 2.0)
    assert width.typical == (0.8, 1.6)
    assert height.typical == (0.3, 1.0), "the range is typical where nothing else is said"
    assert (width.paper, height.paper) == ("width", "leg")


def test_derived_dimensions_point_to_their_parameters(table: AffineTemplate) -> None:
    total, length = table.derived["total"], table.derived["length"]
    assert total.row is not None
    assert total.row.tolist() == [0.05, 0, 1]
    assert (total.extent, total.by) == (None, (1,))
    assert (length.row, length.extent, length.by) == (None, "x", (0, 1))


def test_constants_go_to_the_base(table: AffineTemplate) -> None:
    np.testing.assert_allclose(np.ptp(table.decode(np.zeros(2)), axis=0), [0.2, 0.05, 0.2])
    np.testing.assert_allclose(np.ptp(table.decode([1.2, 0.7]), axis=0), [1.2, 0.75, 0.6])
    np.testing.assert_allclose(table.relations, [[0, 1, -0.25], [-0.4, 0, 1]])
    assert table.relation_texts == ("width - height / 4", "height - 0.4")
    assert table.broken_relations(np.array([1.2, 0.45])) == []
    assert table.broken_relations(np.array([1.2, 0.35])) == ["height - 0.4"]
    constant, jacobian = table.anchor("floor")
    assert (constant + jacobian @ [1.2, 0.7]).tolist() == pytest.approx([0, -0.725, 0])


def test_a_part_is_placed_by_its_centre_and_size(table: AffineTemplate) -> None:
    vertices = table.decode([1.2, 0.7])[table.part == table.parts.index("leg")]
    np.testing.assert_allclose(vertices.min(axis=0), [0.5, -0.725, 0.2])
    np.testing.assert_allclose(vertices.max(axis=0), [0.6, -0.025, 0.3])


@pytest.mark.parametrize(
    ("name", "sign"), [("left_leg", (-1, 1, 1)), ("rear_left_leg", (-1, 1, -1))]
)
def test_mirrored_copies_are_reflections_that_still_look_outwards(
    table: AffineTemplate, name: str, sign: tuple[int, int, int]
) -> None:
    assert table.parts == ("top", "leg", "left_leg", "rear_left_leg")
    vertices = table.decode([1.2, 0.7])
    own, source = (table.part == table.parts.index(part) for part in (name, "leg"))
    np.testing.assert_allclose(vertices[own], vertices[source] * sign)
    faces = table.faces[own[table.faces[:, 0]]]
    corners = vertices[faces]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward = corners.mean(axis=1) - vertices[own].mean(axis=0)
    assert (np.einsum("fc,fc->f", facing, outward) > 0).all()


def test_hidden_sides_are_hidden_in_every_copy(table: AffineTemplate) -> None:
    part = table.part[table.faces[:, 0]]
    heights = table.decode([1.2, 0.7])[table.faces, 1]
    at_the_top = np.isclose(heights, -0.025).all(axis=1) & (part > 0)
    assert np.array_equal(table.hidden, at_the_top)
    assert np.bincount(part[table.hidden], minlength=4).tolist() == [0, 2, 2, 2]


def test_nuisance_parameters_may_be_signed_and_are_not_public() -> None:
    entry = {"label": "Offset", "group": "top", "range": [-0.2, 0.3], "nuisance": True}
    template = compile_template(changed("parameters.offset", entry))
    assert template.names == ("width", "height", "offset")
    assert template.public.tolist() == [True, True, False]
    assert template.signed.tolist() == [False, False, True]
    assert (template.low[2], template.high[2]) == (-0.2, 0.3)
    positive = compile_template(changed("parameters.offset", entry | {"range": [0.1, 0.3]}))
    assert not positive.signed.any()
    assert positive.public.tolist() == [True, True, False]


def test_what_follows_nothing_moves_alone(table: AffineTemplate) -> None:
    np.testing.assert_array_equal(table.following(np.array([1.2, 0.7])), np.eye(2))


@pytest.mark.parametrize("follows", ["offset", "depth"])
def test_a_nuisance_parameter_follows_a_public_one_only(follows: str) -> None:
    entry = {"label": "Offset", "group": "top", "range": [-0.2, 0.3], "nuisance": True}
    good = compile_template(changed("parameters.offset", entry | {"follows": "width"}))
    expected = np.eye(3)
    expected[2, 0] = 0.15
    np.testing.assert_allclose(good.following(np.array([2.0, 0.5, 0.3])), expected, atol=1e-12)
    for bad in (entry | {"follows": follows}, entry | {"follows": "width", "nuisance": False,
                                                       "range": [0.1, 0.2]}):  # fmt: skip
        with pytest.raises(TemplateError, match="'offset' follows"):
            compile_template(changed("parameters.offset", bad))


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("name", None, "the entry 'name' is missing"),
        ("parameters", None, "the entry 'parameters' is missing"),
        ("parts.leg.size", None, "the entry 'size' is missing"),
        ("parameters.width.range", None, "the entry 'range' is missing"),
        ("keep", None, "the entry 'keep' is missing"),
        ("parts.leg.shape", "sphere", "part 'leg': no shape is named 'sphere'"),
        ("parts.leg.hidden", ["inside"], "part 'leg': no side is named 'inside'"),
        ("parts.top.size", ["width * width", 1, 1], "a product of parameters is not affine"),
        ("parts.top.size", ["depth", 1, 1], "no parameter is named 'depth'"),
        ("relations", ["width >= height"], "is not allowed here"),
        ("derived.total.value", "height +", "is not an expression"),
        ("parameters.width.range", [2, 1], "parameter 'width': the range"),
        ("parameters.width.range", [0, 1], "parameter 'width': the range"),
        ("parameters.width.range", [1, 1], "parameter 'width': the range"),
        ("parameters.width.range", 3, "an entry has the wrong form"),
        ("parameters.width.range", ["low", "high"], "an entry has the wrong form"),
        ("parameters", ["width"], "an entry has the wrong form"),
        ("parameters.width.range", [-1, 1], "only nuisance parameters may be signed"),
        ("parameters.width.nuisance", "maybe", "an entry has the wrong form"),
        ("parts.leg.cells", [1, 2], "part 'leg': cells of a box are 3 numbers"),
        ("parts.leg.along", "w", "part 'leg': along 'w' is no axis"),
        ("parts.leg.center", [0, 0], "an entry has the wrong form"),
        ("derived.total.by", ["depth"], "an entry has the wrong form"),
        ("derived.total.measure", {"part": "top", "face": "+x", "from": "floor"}, "no other way"),
        ("derived.total.measure", {"face": "+y", "from": "floor"}, "the entry 'part' is missing"),
        ("derived.total.measure", "top", "an entry has the wrong form"),
        (
            "derived.length.measure",
            {"part": "top", "face": "+y", "from": "floor"},
            "an extent is measured as it is",
        ),
    ],
)
def test_a_bad_entry_is_refused_by_name(path: str, value: Any, message: str) -> None:
    with pytest.raises(TemplateError, match=message):
        compile_template(changed(path, value))


def test_a_row_may_say_where_it_is_measured() -> None:
    measure = {"part": "top", "face": "+y", "from": "floor"}
    derived = compile_template(changed("derived.total.measure", measure)).derived
    assert derived["total"].on == "top"
    assert derived["length"].on is None


def test_a_template_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TemplateError, match="no built-in template named 'sofa'"):
        load_template("sofa")
    with pytest.raises(TemplateError, match=r"sofa\.yaml"):
        load_template(tmp_path / "sofa.yaml")
    with pytest.raises(TemplateError, match=r"sofa\.yaml"):
        load_template(str(tmp_path / "sofa.yaml"))


@pytest.mark.parametrize("text", ["", "just text", "[1, 2]", "name: [", "\tname: x"])
def test_a_file_that_is_no_template_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "odd.yaml"
    path.write_text(text, "utf-8")
    with pytest.raises(TemplateError, match=r"odd\.yaml|an entry has the wrong form"):
        load_template(path)


def test_variants_lack_parts_and_their_mirrored_copies() -> None:
    spec = {**SPEC, "variants": {"table": {}, "slab": {"without": ["leg"]}}}
    whole = compile_template(spec)
    table, slab = whole.variants
    assert (table.variant, slab.variant, whole.variant) == ("table", "slab", "")
    assert (table.parts, slab.parts) == (whole.parts, ("top",))
    np.testing.assert_array_equal(table.decode([1.2, 0.7]), whole.decode([1.2, 0.7]))
    np.testing.assert_array_equal(
        slab.decode([1.2, 0.7]), whole.decode([1.2, 0.7])[whole.part == 0]
    )
    assert slab.faces.max() == len(slab.base) - 1
    assert slab.active.tolist() == [True, False]
    assert slab.variants == (slab,)
    assert compile_template(SPEC).present == {}


@pytest.mark.parametrize(
    ("without", "message"),
    [
        (["legs"], "no part is named 'legs'"),
        (["left_leg"], "no part"),
        (["top", "leg"], "no parts"),
    ],
)
def test_variants_that_make_no_sense_are_refused(without: list[str], message: str) -> None:
    with pytest.raises(TemplateError, match=message):
        compile_template({**SPEC, "variants": {"odd": {"without": without}}})
