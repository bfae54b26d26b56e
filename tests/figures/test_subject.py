from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from model_export.figures.studio import Studio
from model_export.figures.subject import RED, Subject, template_of, tinted, uploaded
from model_export.pictures import BLUE, GREY, YELLOW
from service.edits import Change
from service.requests import Upload

WIDER = {"seat_width": Change("scale", 1.4)}


@pytest.fixture(scope="module")
def chair(studio: Studio) -> Subject:
    (subject,) = studio.subjects("chairs", {"any": ""})
    return subject


@pytest.fixture(scope="module")
def body(studio: Studio) -> Subject:
    (subject,) = studio.subjects("humans", {"any": ""})
    return subject


def test_a_file_goes_with_what_it_names(tmp_path: Path) -> None:
    (tmp_path / "plain.obj").write_text("v 0 0 0\n")
    (tmp_path / "nice.obj").write_text("mtllib nice.mtl\nv 0 0 0\n")
    (tmp_path / "nice.mtl").write_text("newmtl wood\n")
    assert uploaded(tmp_path / "plain.obj") == Upload(b"v 0 0 0\n", "plain.obj")
    nice = uploaded(tmp_path / "nice.obj")
    assert nice.name == "nice.zip"
    assert nice.data.startswith(b"PK")


def test_the_template_lies_over_the_mesh(chair: Subject) -> None:
    own, template = chair.fitted("fit").meshes
    assert (own[2], template[2]) == (YELLOW, BLUE)
    away, _ = cKDTree(own[0]).query(template[0][np.unique(template[1])])
    assert np.median(away) < 0.05


def test_a_mesh_is_shown_upright_however_it_came(chair: Subject, studio: Studio) -> None:
    mesh = chair.found.mesh
    lying = trimesh.Trimesh(mesh.vertices[:, [2, 0, 1]] * 100, mesh.faces, process=False)
    other = studio.subject("lying", Upload(lying.export(file_type="ply"), "lying.ply"))
    shown = [subject.shown("").meshes[0][0] for subject in (chair, other)]
    np.testing.assert_allclose(shown[0], shown[1], atol=1e-3)
    moved = [subject.edited("", WIDER).meshes[0][0] for subject in (chair, other)]
    np.testing.assert_allclose(moved[0], moved[1], atol=0.02)


def test_an_edit_moves_mesh_and_template_alike(chair: Subject) -> None:
    panel = chair.edited("seat_width\nx 1.4", WIDER)
    assert panel.title.startswith("seat_width\nx 1.4")
    vertices = panel.meshes[0][0]
    before, after = (np.ptp(points, axis=0) for points in (chair.found.vertices, vertices))
    assert after[0] > 1.2 * before[0]
    np.testing.assert_allclose(after[1:], before[1:], rtol=0.02)
    plain, wider = (chair.template("", change).meshes[0][0] for change in ({}, WIDER))
    assert np.ptp(wider[:, 0]) - np.ptp(plain[:, 0]) == pytest.approx(
        after[0] - before[0], rel=0.15
    )


def test_the_template_of_no_edit_is_the_fitted_one(chair: Subject, body: Subject) -> None:
    for subject in (chair, body):
        (plain, faces), (same, _) = template_of(subject.found), template_of(subject.found, {})
        np.testing.assert_array_equal(plain, same)
        assert faces.max() < len(plain)


def test_a_body_is_edited_as_its_template_is(body: Subject) -> None:
    bend = {"left_elbow_y": Change("add", -0.8)}
    vertices = body.edited("", bend).meshes[0][0]
    template = body.template("", bend).meshes[0][0]
    # The body is the template's own, so that both have the same vertices.
    assert np.abs(vertices - body.found.vertices).max() > 0.05
    assert np.abs(vertices - template).mean() < 0.005
    taller = {"shape_0": Change("add", 1.0)}
    shown = body.edited("", taller).meshes[0][0], body.template("", taller).meshes[0][0]
    assert np.abs(shown[0] - shown[1]).mean() < 0.005


def test_values_that_are_not_reached_are_told(chair: Subject) -> None:
    title = chair.edited("a", {"back_height": Change("scale", 0.0)}).title
    assert title.startswith("a, only x ") or title == "a: refused"
    assert chair.edited("a", {"seat_width": Change("scale", 1.0)}).title == "a, nothing moves"


def test_what_is_refused_is_shown_as_it_came(
    chair: Subject, capsys: pytest.CaptureFixture[str]
) -> None:
    panel = chair.edited("wing_length", {"wing_length": Change("scale", 2.0)})
    assert panel.title == "wing_length: refused"
    np.testing.assert_array_equal(panel.meshes[0][0], chair.found.vertices)
    assert "refused, unknown_parameter" in capsys.readouterr().err


def test_what_is_not_recognised_is_edited_as_what_it_is_most_like(studio: Studio) -> None:
    rng = np.random.default_rng(0)
    boxes = [
        trimesh.creation.box(rng.uniform(0.1, 1, 3)).apply_translation(rng.uniform(-1, 1, 3))
        for _ in range(8)
    ]
    heap = trimesh.util.concatenate(boxes)
    subject = studio.subject("heap", Upload(heap.export(file_type="ply"), "heap.ply"))
    assert not subject.found.in_distribution
    assert "(not recognised by itself)" in subject.fitted("fit").title
    name = next(iter(subject.found.parameter_report()))
    assert "refused" not in subject.edited(name, {name: Change("scale", 1.1)}).title


def test_the_farther_the_redder() -> None:
    faces = np.array([[0, 0, 0], [0, 0, 1], [1, 1, 1]])
    colours = np.asarray(tinted(np.array([0.0, 0.2]), faces))
    np.testing.assert_allclose(colours[[0, 2]], [GREY, RED])
    np.testing.assert_allclose(colours[1], np.array(GREY) * 2 / 3 + np.array(RED) / 3)
    still = np.asarray(tinted(np.zeros(2), faces))
    np.testing.assert_allclose(still, np.broadcast_to(GREY, (3, 3)))


def test_nothing_is_said_of_an_upload_but_what_the_caller_says(studio: Studio) -> None:
    upload = Upload(b"")
    assert studio.subject("a", upload).options.category == "auto"
    told = studio.subject("a", upload, "chair")
    assert replace(told.options, category="auto") == studio.subject("a", upload).options
    assert told.options.category == "chair"
