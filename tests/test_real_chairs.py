"""Real chairs, where the folder with them lies beside the checkout; without it nothing is run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import service
from service.affineinference import AffineInference
from service.deform.measured import find_levels
from service.edits import Change
from service.encode.model import Model, load_models
from service.mesh.formats import read_mesh
from service.pipeline import edit, infer
from service.requests import EditOptions, InferOptions, Upload

FOLDER = Path(__file__).parents[2] / "shared" / "data" / "chairs"
ORIGINALS = sorted((FOLDER / "originals").glob("polyhaven-*/*.glb"))
MESHES = sorted((FOLDER / "meshes").glob("*.ply"))[::24]
POSTS = sorted(FOLDER.glob("meshes/polyhaven-woodenchair-01.ply"))
UPRIGHT = InferOptions(up="+y", front="+z", category="chair")


@pytest.fixture(scope="module")
def models() -> dict[str, Model]:
    return load_models(Path(service.__file__).parent / "models")


def upload(path: Path) -> Upload:
    return Upload(path.read_bytes(), path.name)


@pytest.mark.parametrize("path", ORIGINALS, ids=lambda path: path.parent.name)
def test_textured_originals_come_back_whole(models: dict[str, Model], path: Path) -> None:
    sent = upload(path)
    assert edit(sent, models, InferOptions(), {}, EditOptions()).data == sent.data
    change = {"seat_width": Change("scale", 1.2)}
    edited = edit(sent, models, InferOptions(), change, EditOptions())
    before, after = read_mesh(sent.data, path.name), read_mesh(edited.data, path.name)
    np.testing.assert_array_equal(after.faces, before.faces)
    assert np.isfinite(after.vertices).all()
    assert np.ptp(after.vertices[:, 0]) > 1.05 * np.ptp(before.vertices[:, 0])
    np.testing.assert_array_equal(after.vertices[:, 1:], before.vertices[:, 1:])


@pytest.mark.parametrize("path", MESHES, ids=lambda path: path.stem)
def test_every_edit_of_a_real_chair_is_answered(models: dict[str, Model], path: Path) -> None:
    sent = upload(path)
    found = infer(sent, models, UPRIGHT)
    for name, entry in found.report()["parameters"].items():
        assert entry["value"] > 0
        for factor in (0.7, 1.4):
            change = {name: Change("scale", factor)}
            edited = edit(sent, models, UPRIGHT, change, EditOptions())
            assert np.isfinite(read_mesh(edited.data, path.name).vertices).all()
            assert edited.report["flipped_faces"] <= 0.05 * len(found.mesh.faces)


@pytest.mark.parametrize("path", MESHES, ids=lambda path: path.stem)
def test_a_seat_is_as_high_as_it_is_asked_to_be(models: dict[str, Model], path: Path) -> None:
    sent = upload(path)
    found = infer(sent, models, UPRIGHT)
    assert isinstance(found, AffineInference)
    fit, before = found.fit, found.report()["derived"]["seat_top_height"]["value"]
    for factor in (0.9, 1.1):
        asked = factor * before
        change = {"seat_top_height": Change("set", asked)}
        edited = edit(sent, models, UPRIGHT, change, EditOptions())
        told = [text for text in edited.report["warnings"] if text.startswith("seat_top_height")]
        if any("goes by the fit" in text or ", not " in text for text in told):
            continue
        assert edited.parameters["seat_top_height"] == pytest.approx(asked)
        # Measured anew, on the file that came back.
        turned = found.best.orientation.to_canonical(read_mesh(edited.data, path.name).vertices)
        vertices = fit.normalization.apply(turned)
        vertices[:, 1] += found.vertices[:, 1].min() - vertices[:, 1].min()
        f = fit.parameters.copy()
        leg = fit.template.names.index("leg_height")
        raised = asked * found.scale - (f[leg] + f[fit.template.names.index("seat_thickness")])
        shift = fit.translation + np.array([0.0, raised, 0.0])
        level = find_levels(vertices, found.mesh.faces, fit.template, f, shift)["seat_top_height"]
        height = float(level.of(vertices[:, 1])) - vertices[:, 1].min()
        assert height / found.scale == pytest.approx(asked, rel=0.01)
        assert edited.report["dimensions"]["seat_top_height"]["after"] == pytest.approx(asked)


@pytest.mark.parametrize("path", POSTS, ids=lambda path: path.stem)
def test_posts_from_the_floor_to_the_top_follow_leg_and_back(
    models: dict[str, Model], path: Path
) -> None:
    sent = upload(path)
    change = {"back_height": Change("scale", 0.7)}
    edited = edit(sent, models, UPRIGHT, change, EditOptions())
    report = edited.report["parameters"]["back_height"]
    lower = report["before"] - report["after"]
    top, lowered = (
        read_mesh(data, path.name).vertices[:, 1].max() for data in (sent.data, edited.data)
    )
    assert top - lowered == pytest.approx(lower, rel=0.1)
