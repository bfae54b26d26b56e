"""A small category, quick to train on, and a folder of meshes to learn from."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import trimesh
import yaml

from model_export.config import Config
from model_export.synthetic import Augmentation
from service.encode.model import Encoding
from service.template.affine import AffineTemplate
from service.template.loader import compile_template, load_template

STAND = """
# A slab on a post; the post's bottom is hidden, though nothing covers it.
name: stand
label: Stand
points: 64
parameters:
  slab_width: {label: Slab width, group: slab, range: [0.5, 1.5]}
  slab_height: {label: Slab height, group: slab, range: [0.05, 0.2]}
  post_height: {label: Post height, group: post, range: [0.3, 1.2], paper: post length}
relations:
  - slab_width - slab_height * 4
parts:
  slab: {shape: box, cells: [2, 1, 2], center: [0, 0, 0],
         size: [slab_width, slab_height, slab_width]}
  post: {shape: box, cells: [1, 2, 1], center: [0, -slab_height / 2 - post_height / 2, 0],
         size: [slab_width / 4, post_height, slab_width / 4], hidden: [top, bottom]}
derived:
  total_height: {label: Total height, group: all, extent: y, by: [post_height], typical: [0.3, 1]}
keep:
  floor: [0, -slab_height / 2 - post_height, 0]
"""


@pytest.fixture(scope="session", autouse=True)
def _one_thread() -> Iterator[None]:
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@pytest.fixture(scope="session")
def chair() -> AffineTemplate:
    """The paper's, of eight parameters."""
    return load_template("paper_chair")


@pytest.fixture(scope="session")
def stand_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("template") / "stand.yaml"
    path.write_text(STAND, "utf-8")
    return path


@pytest.fixture(scope="session")
def stand(stand_file: Path) -> AffineTemplate:
    return load_template(stand_file)


@pytest.fixture(scope="session")
def kinds() -> AffineTemplate:
    """A slab on a post or on the floor: the post's height is idle in the second."""
    spec = yaml.safe_load(STAND)
    spec["parameters"]["post_height"]["nuisance"] = True
    spec["variants"] = {"high": {}, "low": {"without": ["post"]}}
    return compile_template(spec)


@pytest.fixture(scope="session")
def small_config(stand_file: Path) -> Config:
    """A run of seconds."""
    return Config(
        template=str(stand_file),
        steps=60,
        batch=8,
        points=(48, 64),
        final_points=64,
        final_share=0.1,
        learning_rate=3e-3,
        shared=(16, 32),
        head=(16,),
        augmentation=Augmentation.none(),
        seed=5,
    )


@pytest.fixture(scope="session")
def meshes(stand: AffineTemplate, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten stands of different shapes, in three formats, one of them in a folder below."""
    folder = tmp_path_factory.mktemp("meshes")
    (folder / "more").mkdir()
    rng = np.random.default_rng(0)
    for index in range(10):
        vertices = stand.decode(rng.uniform(stand.low, stand.high)) + np.array([index, 0, 0])
        mesh = trimesh.Trimesh(vertices, stand.faces, process=False)
        suffix = ("obj", "ply", "off")[index % 3]
        place = folder / "more" if index == 9 else folder
        mesh.export(place / f"stand{index}.{suffix}")
    return folder


class MeanModel:
    """Stands for an encoder: answers the same for every stand."""

    points = 300
    answer = np.array([0.7, 0.1, 0.5])
    place = np.array([0.0, 0.2, 0.0])

    def __init__(self, template: AffineTemplate) -> None:
        self.template = template

    @property
    def discriminator(self) -> MeanModel:
        return self

    def odds(self, cloud: np.ndarray, orientations: list[Any]) -> np.ndarray:
        return np.zeros(len(orientations))

    @property
    def sigma_scale(self) -> np.ndarray:
        return np.ones(3)

    def score(self, distance: float, odds: float) -> float:
        return 1.0 / (1.0 + distance)

    def encode(self, points: np.ndarray) -> Encoding:
        assert points.shape == (self.points, 3)
        assert np.linalg.norm(points, axis=1).max() == pytest.approx(0.6)
        return Encoding(self.answer, self.place, np.ones(1))


@pytest.fixture(scope="session")
def mean_model(stand: AffineTemplate) -> Any:
    return MeanModel(stand)
