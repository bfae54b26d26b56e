"""The installed chair model, clouds with known answers, and networks of next to no layers."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import onnx
import pytest
from numpy.typing import NDArray
from onnx import TensorProto, helper
from plain_chair import PLAIN
from six_boxes import ANSWER, SIX_BOXES

import service
from service.encode.distance import Cloud
from service.encode.model import Model, file_digest, golden_cloud, load_models
from service.encode.session import EncoderSession
from service.mesh.surface import Normalization, Samples, sample_surface
from service.template.affine import AffineTemplate
from service.template.loader import load_template

Array = NDArray[np.float64]
Labelled = tuple[Cloud, Array, Array]
WriteNetwork = Callable[..., Path]
WriteDiscriminator = Callable[[Path], Path]


@pytest.fixture(scope="session")
def chair() -> AffineTemplate:
    """The paper's; its eight parameters are the first ones of the served template too."""
    return load_template("paper_chair")


@pytest.fixture(scope="session")
def plain(chair: AffineTemplate) -> Array:
    """``[8]`` parameters of an ordinary chair, in metres."""
    return np.array([PLAIN[name] for name in chair.names])


@pytest.fixture(scope="session")
def chair_model() -> Model:
    """The installed model."""
    return load_models(Path(service.__file__).parent / "models")["chair"]


def surface(template: AffineTemplate, f: Array, count: int, seed: int) -> Samples:
    """Samples of the visible faces of the template at ``f [d]``."""
    visible = template.faces[~template.hidden]
    return sample_surface(template.decode(f), visible, count, np.random.default_rng(seed))


@pytest.fixture(scope="session")
def chair_samples(chair: AffineTemplate, plain: Array) -> Samples:
    """2840 samples of the ordinary chair, in metres, canonically oriented."""
    return surface(chair, plain, 2840, 1)


@pytest.fixture(scope="session")
def labelled(chair: AffineTemplate) -> Callable[..., Labelled]:
    """Makes a noisy normalised cloud of a chair, with its parameters and translation."""

    def make(f: Array, noise: float = 0.0, seed: int = 0, count: int = 2840) -> Labelled:
        samples = surface(chair, f, count, seed)
        normalization = Normalization.of(samples.points)
        points = normalization.apply(samples.points)
        points = points + noise * np.random.default_rng(seed).standard_normal(points.shape)
        translation = -normalization.center * normalization.scale
        return Cloud(points, samples.normals), f * normalization.scale, translation

    return make


@pytest.fixture(scope="session")
def write_network() -> WriteNetwork:
    """Writes a network that answers given numbers, then the cloud's largest x, y and z."""

    def write(path: Path, answer: list[float], shape: tuple[int | str, ...] = (1, 50, 3)) -> Path:
        axes = helper.make_tensor("axes", TensorProto.INT64, [1], [1])
        row = helper.make_tensor("row", TensorProto.FLOAT, [1, len(answer)], answer)
        largest = "largest" if answer else "outputs"
        nodes = [helper.make_node("ReduceMax", ["points", "axes"], [largest], keepdims=0)]
        if answer:
            nodes.append(helper.make_node("Concat", ["row", "largest"], ["outputs"], axis=1))
        graph = helper.make_graph(
            nodes,
            "network",
            [helper.make_tensor_value_info("points", TensorProto.FLOAT, shape)],
            [helper.make_tensor_value_info("outputs", TensorProto.FLOAT, None)],
            [axes, row],
        )
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=10)
        onnx.save(model, path)
        return path

    return write


@pytest.fixture(scope="session")
def write_discriminator() -> WriteDiscriminator:
    """Writes a discriminator of 30 points whose log odds are ten times the largest y, less 2."""

    def write(path: Path) -> Path:
        initializers = [
            helper.make_tensor("axes", TensorProto.INT64, [1], [1]),
            helper.make_tensor("up", TensorProto.INT64, [], [1]),
            helper.make_tensor("ten", TensorProto.FLOAT, [], [10.0]),
            helper.make_tensor("two", TensorProto.FLOAT, [], [2.0]),
        ]
        nodes = [
            helper.make_node("ReduceMax", ["views", "axes"], ["largest"], keepdims=0),
            helper.make_node("Gather", ["largest", "up"], ["height"], axis=1),
            helper.make_node("Mul", ["height", "ten"], ["tenfold"]),
            helper.make_node("Sub", ["tenfold", "two"], ["odds"]),
        ]
        graph = helper.make_graph(
            nodes,
            "discriminator",
            [helper.make_tensor_value_info("views", TensorProto.FLOAT, ("count", 30, 3))],
            [helper.make_tensor_value_info("odds", TensorProto.FLOAT, None)],
            initializers,
        )
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=10)
        onnx.save(model, path)
        return path

    return write


@pytest.fixture
def folder(
    tmp_path: Path,
    write_network: WriteNetwork,
    write_discriminator: WriteDiscriminator,
    chair: AffineTemplate,
) -> Path:
    """A models folder with a chair of six boxes whose network answers `ANSWER`."""
    network = write_network(tmp_path / "chair.onnx", ANSWER, (1, 100, 3))
    discriminator = write_discriminator(tmp_path / "chair.discriminator.onnx")
    golden = EncoderSession(network).run(golden_cloud(chair, 100))
    card = {
        "name": "chair",
        "version": "1.2.3",
        "digest": file_digest(network),
        "golden": golden.tolist(),
        "discriminator": {"digest": file_digest(discriminator)},
        "calibration": {"limit_distance": 0.03, "limit_odds": 1.0},
    }
    (tmp_path / "chair.json").write_text(json.dumps(card), "utf-8")
    (tmp_path / "chair.yaml").write_text(SIX_BOXES, "utf-8")
    return tmp_path
