from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pretend_body import POINTS, write_mesh_encoder

from service.encode.bodyestimate import SIGMA_ENCODER
from service.encode.bodymesh import estimate_mesh
from service.encode.meshencoder import MeshEncoder
from service.mesh.surface import Samples, sample_surface
from service.template.skinned import NAMES, Body, SkinnedTemplate


@pytest.fixture(scope="module")
def samples(human: SkinnedTemplate, strider: Body) -> Samples:
    vertices = human.decode(strider)
    return sample_surface(vertices, human.faces, POINTS, np.random.default_rng(0))


@pytest.fixture
def encoder(human: SkinnedTemplate, strider: Body, tmp_path: Path) -> MeshEncoder:
    """It takes everyone for the strider with another elbow."""
    values = strider.parameters
    values[NAMES.index("left_elbow_y")] -= 0.5
    known = strider.with_parameters(values)
    return MeshEncoder(write_mesh_encoder(tmp_path / "human.mesh.onnx", human, known), human)


def test_unrefined_it_is_the_encoders_answer(
    human: SkinnedTemplate, strider: Body, samples: Samples, encoder: MeshEncoder
) -> None:
    vertices = human.decode(strider)
    fit = estimate_mesh(human, encoder, vertices, samples, False)
    body = encoder.encode(fit.normalization.apply(vertices))
    assert np.array_equal(fit.body.parameters, body.parameters)
    assert fit.distance == fit.encoder_distance
    assert (fit.sigma == SIGMA_ENCODER).all()


def test_refined_its_vertices_are_the_meshs(
    human: SkinnedTemplate, strider: Body, samples: Samples, encoder: MeshEncoder
) -> None:
    fit = estimate_mesh(human, encoder, human.decode(strider), samples, True, 1.0)
    np.testing.assert_allclose(
        fit.normalization.invert(human.decode(fit.body)), human.decode(strider), atol=0.002
    )
    np.testing.assert_allclose(fit.body.parameters[:72], strider.parameters[:72], atol=0.03)
    assert fit.distance < fit.encoder_distance
    assert (fit.sigma < SIGMA_ENCODER).all()


def test_a_unit_is_heard_where_it_is_plausible(
    human: SkinnedTemplate, strider: Body, samples: Samples, encoder: MeshEncoder
) -> None:
    vertices = human.decode(strider)
    unsaid, longer, absurd = (
        estimate_mesh(human, encoder, vertices, samples, True, metre).body.scale
        for metre in (None, 1.05, 100.0)
    )
    assert longer > unsaid
    assert absurd == unsaid


def test_faces_that_are_wound_the_wrong_way_round_do_no_harm(
    human: SkinnedTemplate, strider: Body, samples: Samples, encoder: MeshEncoder
) -> None:
    vertices = human.decode(strider)
    turned = replace(samples, normals=-samples.normals)
    right, wrong = (
        estimate_mesh(human, encoder, vertices, each, False) for each in (samples, turned)
    )
    assert (right.inside_out, wrong.inside_out) == (False, True)
    assert wrong.distance == pytest.approx(right.distance)
