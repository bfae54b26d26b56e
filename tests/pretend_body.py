"""A body of known pose, and a model of bodies whose networks know nothing but it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import trimesh
from numpy.typing import NDArray
from onnx import TensorProto, helper
from trimesh.exchange.export import export_mesh

from service.encode.basemodel import file_digest
from service.encode.bodymodel import golden_cloud
from service.encode.session import EncoderSession
from service.mesh.surface import Normalization, sample_surface
from service.requests import Upload
from service.template.anatomy import JOINTS, PARENTS
from service.template.skinned import Body, SkinnedTemplate, body_of
from service.template.skinning import pose_joints

Array = NDArray[np.float64]

POINTS, VIEW = 900, 250
"""Sizes of the clouds that the encoder and the discriminator take."""
SHAPE = (0.6, 0.3, -0.5)
POSE = {
    "left_shoulder": (0.1, -0.2, -1.0),
    "right_shoulder": (0.0, 0.2, 1.1),
    "left_elbow": (0.0, -0.9, 0.0),
    "right_elbow": (0.0, 0.3, 0.0),
    "left_hip": (-0.5, 0.0, 0.1),
    "left_knee": (0.6, 0.0, 0.0),
    "right_hip": (0.1, 0.0, -0.1),
    "head": (0.1, 0.3, 0.0),
}


def posed(template: SkinnedTemplate) -> Body:
    """Someone who strides, in metres, with the lowest point at y = 0."""
    vectors = np.zeros((len(JOINTS), 3))
    for name, vector in POSE.items():
        vectors[JOINTS.index(name)] = vector
    body = body_of(vectors, np.array(SHAPE), 1.0, np.zeros(3))
    lowest = template.decode(body)[:, 1].min()
    return replace(body, translation=np.array([0.0, -lowest, 0.0]))


def saved(
    template: SkinnedTemplate, body: Body, format: str, turn: Array | None = None, size: float = 1.0
) -> Upload:
    """A body as a file, in the axes whose orientation has the rotation ``turn``."""
    vertices = size * template.decode(body)
    mesh = trimesh.Trimesh(
        vertices if turn is None else vertices @ turn, template.faces, process=False
    )
    data: Any = export_mesh(mesh, None, file_type=format)
    return Upload(data.encode() if isinstance(data, str) else bytes(data), f"body.{format}")


def answer(template: SkinnedTemplate, body: Body) -> Array:
    """``[OUTPUTS]`` that a perfect encoder says of a body."""
    samples = sample_surface(
        template.decode(body), template.faces, POINTS, np.random.default_rng(0)
    )
    frame = Normalization.of(samples.points)
    joints = template.joints + template.joint_dirs @ body.shape
    turned, _ = pose_joints(body.rotations, joints, PARENTS)
    columns = turned[:, :, :2].transpose(0, 2, 1)
    scale = np.log(body.scale * frame.scale)
    placed = frame.apply(template.posed_joints(body))
    return np.concatenate([placed.ravel(), columns.ravel(), body.shape, [scale]])


def write_body_model(folder: Path, template: SkinnedTemplate, body: Body, **card: Any) -> Path:
    """Write the files of a model, named human, to a folder; ``card`` adds to the card."""
    network = _write_encoder(folder / "human.onnx", answer(template, body).tolist())
    discriminator = _write_discriminator(folder / "human.discriminator.onnx", template, body)
    entries = {
        "name": "human",
        "kind": "skinned",
        "version": "0.1",
        "digest": file_digest(network),
        "template_digest": template.digest,
        "golden": EncoderSession(network).run(golden_cloud(POINTS)).tolist(),
        "discriminator": {"digest": file_digest(discriminator)},
        "calibration": {"limit_distance": 0.03, "limit_odds": 0.0},
    }
    path = folder / "human.json"
    path.write_text(json.dumps({**entries, **card}), "utf-8")
    return path


def write_mesh_encoder(path: Path, template: SkinnedTemplate, body: Body) -> Path:
    """A network that answers the rotations and the shape of a body to all vertices."""
    outputs = answer(template, body)[3 * len(JOINTS) : -1].tolist()
    constants, nodes = _constant("vertices", outputs)
    return _write(path, nodes, constants, ("vertices", (1, len(template.rest), 3)), "outputs")


def _write_encoder(path: Path, outputs: list[float]) -> Path:
    """A network that answers the same to every cloud."""
    constants, nodes = _constant("points", outputs)
    return _write(path, nodes, constants, ("points", (1, POINTS, 3)), "outputs")


def _constant(takes: str, outputs: list[float]) -> tuple[list[Any], list[Any]]:
    """Constants and nodes that answer the same to everything."""
    constants = [
        helper.make_tensor("axes", TensorProto.INT64, [2], [1, 2]),
        helper.make_tensor("zero", TensorProto.FLOAT, [], [0.0]),
        helper.make_tensor("answer", TensorProto.FLOAT, [1, len(outputs)], outputs),
    ]
    nodes = [
        helper.make_node("ReduceMax", [takes, "axes"], ["largest"], keepdims=0),
        helper.make_node("Mul", ["largest", "zero"], ["nothing"]),
        helper.make_node("Add", ["answer", "nothing"], ["outputs"]),
    ]
    return constants, nodes


def _write_discriminator(path: Path, template: SkinnedTemplate, body: Body) -> Path:
    """A network whose log odds fall with the distance of a view from the body."""
    own = sample_surface(template.decode(body), template.faces, VIEW, np.random.default_rng(5))
    cloud = Normalization.of(own.points).apply(own.points)
    nodes = [
        helper.make_node("Unsqueeze", ["views", "two"], ["spread"]),
        helper.make_node("Sub", ["spread", "cloud"], ["gaps"]),
        helper.make_node("ReduceSumSquare", ["gaps", "three"], ["squares"], keepdims=0),
        helper.make_node("ReduceMin", ["squares", "two"], ["nearest"], keepdims=0),
        helper.make_node("Sqrt", ["nearest"], ["distances"]),
        helper.make_node("ReduceMean", ["distances", "one"], ["distance"], keepdims=0),
        helper.make_node("Mul", ["distance", "steepness"], ["loss"]),
        helper.make_node("Sub", ["most", "loss"], ["odds"]),
    ]
    constants = [
        *(
            helper.make_tensor(name, TensorProto.INT64, [1], [axis])
            for axis, name in enumerate(("one", "two", "three"), start=1)
        ),
        helper.make_tensor("steepness", TensorProto.FLOAT, [], [300.0]),
        helper.make_tensor("most", TensorProto.FLOAT, [], [15.0]),
        helper.make_tensor("cloud", TensorProto.FLOAT, [1, 1, VIEW, 3], cloud.ravel().tolist()),
    ]
    return _write(path, nodes, constants, ("views", ("count", VIEW, 3)), "odds")


def _write(
    path: Path,
    nodes: Sequence[Any],
    constants: Sequence[Any],
    takes: tuple[str, tuple[int | str, ...]],
    gives: str,
) -> Path:
    name, shape = takes
    graph = helper.make_graph(
        nodes,
        "network",
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)],
        [helper.make_tensor_value_info(gives, TensorProto.FLOAT, None)],
        constants,
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=10)
    onnx.save(model, path)
    return path
