"""Every kind of answer, before Khronos's own validator."""

from __future__ import annotations

import io
import json
import shutil
import subprocess
import zipfile
from collections.abc import Mapping
from itertools import product
from pathlib import Path

import pytest
import trimesh
from PIL import Image
from weighted import json_of, with_json

from service import pipeline
from service.edits import Change
from service.encode.model import SHIPPED, Model, load_models
from service.mesh.convert import convert
from service.requests import EditOptions, InferOptions, SliderOptions, Upload
from service.template.skinned import Body, SkinnedTemplate

HERE = Path(__file__).parent
CHAIR, HUMAN = InferOptions(category="chair"), InferOptions(category="human")


@pytest.fixture(scope="module")
def validator(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the validator and the script that runs it."""
    if shutil.which("npm") is None:
        pytest.skip("the validator comes from npm, which is not installed")
    folder = tmp_path_factory.mktemp("validator")
    for name in ("package.json", "check.mjs"):
        shutil.copy(HERE / name, folder)
    command = ["npm", "install", "--no-package-lock", "--no-audit", "--no-fund"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"npm can't install the validator: {done.stderr[-200:]}")
    return folder


@pytest.fixture(scope="module")
def models() -> Mapping[str, Model]:
    return load_models(SHIPPED)


def with_looks(chair: trimesh.Trimesh) -> Upload:
    """The chair as an OBJ of two materials, with a picture, in a zip."""
    picture, archive = io.BytesIO(), io.BytesIO()
    Image.new("RGB", (4, 4), "brown").save(picture, "PNG")
    rows = ["mtllib chair.mtl", "vt 0 0", "vt 1 0", "vt 0 1", "usemtl wood"]
    rows += ["v {} {} {}".format(*row) for row in chair.vertices]
    rows += ["vn {} {} {}".format(*row) for row in chair.vertex_normals]
    for number, face in enumerate(chair.faces + 1):
        rows += ["usemtl leather"] if number == len(chair.faces) // 2 else []
        rows.append("f " + " ".join(f"{v}/{i}/{v}" for i, v in enumerate(face, 1)))
    wood = "newmtl wood\nmap_Kd -s 2 2 wood.png\nPr 0.5\n"
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("chair.obj", "\n".join(rows))
        file.writestr("chair.mtl", wood + "newmtl leather\nKd 0.1 0 0\nd 0.5\nKe 0 0 1\nNs 9\n")
        file.writestr("wood.png", picture.getvalue())
    return Upload(archive.getvalue(), "chair.zip")


def outputs(
    models: Mapping[str, Model], chair: trimesh.Trimesh, body: trimesh.Trimesh
) -> dict[str, bytes]:
    """Answers by what was asked for."""
    found: dict[str, bytes] = {}
    smooth = chair.subdivide()
    # Normals on demand are exported with the rest.
    assert len(smooth.vertex_normals)
    chairs = {
        "glb": Upload(smooth.export(file_type="glb"), "chair.glb"),
        "obj": Upload(convert(chair.vertices, chair.faces, "obj"), "chair.obj"),
        "gltf": Upload(convert(chair.vertices, chair.faces, "gltf"), "chair.gltf"),
        "looks": with_looks(smooth),
    }
    for (name, upload), paired, quantize in product(chairs.items(), *[(False, True)] * 2):
        options = SliderOptions(paired=paired, quantize=quantize)
        found[f"{name} {options}"] = pipeline.sliders(upload, models, CHAIR, options)
    found["template"] = pipeline.template(chairs["glb"], models, CHAIR, SliderOptions())
    wider = {"seat_width": Change("scale", 1.3)}
    edited = pipeline.edit(chairs["glb"], models, CHAIR, wider, EditOptions())
    found["edit"] = edited.data
    upload = Upload(body.export(file_type="glb"), "body.glb")
    for names, rest in product(("smpl", "mixamo", "vrm"), ("upload", "t_pose")):
        options = SliderOptions(joint_names=names, rest=rest, quantize=rest == "t_pose")
        found[f"body {options}"] = pipeline.sliders(upload, models, HUMAN, options)
    found["body template"] = pipeline.template(upload, models, HUMAN, SliderOptions())
    return found


def test_no_answer_has_a_fault(
    validator: Path,
    models: Mapping[str, Model],
    box_chair: trimesh.Trimesh,
    human: SkinnedTemplate,
    strider: Body,
    tmp_path: Path,
) -> None:
    body = trimesh.Trimesh(human.decode(strider), human.faces, process=False)
    files = outputs(models, box_chair, body)
    for number, content in enumerate(files.values()):
        (tmp_path / f"{number}.glb").write_bytes(content)
    paths = [str(tmp_path / f"{number}.glb") for number in range(len(files))]
    command = ["node", "check.mjs", *paths]
    done = subprocess.run(command, cwd=validator, capture_output=True, text=True, check=True)
    reports = dict(zip(files, json.loads(done.stdout), strict=True))
    assert {name: issues for name, issues in reports.items() if issues} == {}


def test_the_validator_finds_faults(validator: Path, chair_glb: bytes, tmp_path: Path) -> None:
    root = json_of(chair_glb)
    root["accessors"][0]["count"] += 1
    (tmp_path / "bad.glb").write_bytes(with_json(chair_glb, root))
    command = ["node", "check.mjs", str(tmp_path / "bad.glb")]
    done = subprocess.run(command, cwd=validator, capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)[0]
