"""Give an installed model its discriminator: ``python -m model_export.discriminate chair``.

It tells a cloud of the category, upright and facing the front, from the same cloud turned to any
of the other 23 orientations and from shapes of other kinds.  Its labels are free: real shapes are
known to be upright, and template shapes are by construction.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional
from tqdm import tqdm

from model_export.bodies import Garments, SyntheticBodies
from model_export.bodytruth import synthetic_bodies
from model_export.calibrate import calibrate
from model_export.config import SHIPPED
from model_export.distractors import heaps, other_shapes
from model_export.disturb import disturb
from model_export.networks import Discriminator, fold_batch_norm
from model_export.onnxfile import write_network
from model_export.realistic import RealisticShape, find_shapes, normalise
from model_export.samples import clouds_of, synthetic_samples
from model_export.synthetic import Augmentation, SyntheticShapes
from service.encode.discriminator import DISCRIMINATOR_SUFFIX
from service.encode.model import (
    AffineModel,
    BodyModel,
    Model,
    file_digest,
    load_model,
    template_source,
)
from service.mesh.frame import orientations
from service.mesh.surface import Samples
from service.template.affine import AffineTemplate
from service.template.bodyfile import load_body
from service.template.loader import load_template
from service.template.skinned import SkinnedTemplate

POINTS = 512
"""Points that the network looks at."""
POOL = 4096
"""Points that these are drawn from, a shape."""
SHAPES, TURNS, OTHERS = 16, 8, 48
"""Of a batch: shapes of the category, orientations of each (the first is right), other shapes."""
REAL_SHARE, BODY_REAL_SHARE = 0.7, 0.3
"""Share of real shapes among a category's; real bodies come in few poses."""
LEAN = math.radians(30.0)
"""How far bodies may lean whose orientation is still the right one of the 24."""
HEAPS = 600
ROTATIONS = torch.tensor(np.stack([way.rotation for way in orientations()]), dtype=torch.float32)
"""``[24, 3, 3]``; the first leaves a cloud as it is."""


@dataclass(frozen=True)
class Data:
    """The shapes to learn from and to measure on.

    Attributes:
        shapes: real ones of the category, upright; may be none.
        folders, but: where others are, see `other_shapes`; may be none.
    """

    shapes: Sequence[RealisticShape]
    folders: Sequence[Path]
    but: str | None

    @classmethod
    def of(cls, realistic: Path | None, folders: Sequence[Path], but: str | None) -> Data:
        """From what a command line says."""
        return cls(find_shapes(realistic) if realistic else [], folders, but)

    def others(self, points: int, held_out: bool) -> list[Samples]:
        """Samples of the shapes of other kinds on one side of the split."""
        return other_shapes(self.folders, self.but, points, held_out)


@dataclass(frozen=True)
class Clouds:
    """What a discriminator learns from.

    Attributes:
        draw: gives so many synthetic clouds of the category, upright, of so many points.
        real: ``[R, n, 3]`` upright shapes of the category; may be none.
        others: ``[O, n, 3]`` shapes of any other kind, in any orientation.
        real_share: share of real shapes among those of the category, if there are any.
    """

    draw: Callable[[int, int], Tensor]
    real: Tensor
    others: Tensor
    real_share: float = REAL_SHARE


def drawn_from(
    template: AffineTemplate | SkinnedTemplate, seed: int
) -> Callable[[int, int], Tensor]:
    """A source of synthetic clouds ``[count, points, 3]`` of a category, upright or nearly so."""
    if isinstance(template, SkinnedTemplate):
        bodies = SyntheticBodies(template, Garments(tilt=0.3, turn=LEAN), seed)
        return lambda count, points: bodies.batch(count, points).points
    shapes = SyntheticShapes(template, Augmentation(clutter=0.3), seed, 0.25)
    return lambda count, points: shapes.batch(count, points).points


def train(clouds: Clouds, steps: int, seed: int = 0) -> Discriminator:
    """Train a discriminator on the CPU."""
    torch.manual_seed(seed)
    generator = torch.Generator().manual_seed(seed)
    network = Discriminator().train()
    optimizer = torch.optim.AdamW(network.parameters(), 2e-3, weight_decay=1e-3)
    bar = tqdm(range(steps), unit="step", mininterval=2.0)
    for step in bar:
        for group in optimizer.param_groups:
            group["lr"] = 2e-3 * (0.5 * (1 + math.cos(math.pi * step / steps)) + 1e-3)
        own, other = _batch(clouds, generator)
        with torch.autocast("cpu", torch.bfloat16):
            odds = network(torch.cat([own.flatten(0, 1), other]))
        loss = _loss(odds[: SHAPES * TURNS].reshape(SHAPES, TURNS), odds[SHAPES * TURNS :])
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        if step % 20 == 0:
            bar.set_postfix_str(f"loss {loss.item():.3g}", refresh=False)
    return network.eval()


def _loss(own: Tensor, other: Tensor) -> Tensor:
    """Which of a shape's orientations is right, and whether each cloud is right at all.

    Args:
        own: ``[SHAPES, TURNS]`` log odds, the right orientation first.
        other: ``[OTHERS]`` log odds of other shapes.
    """
    choice = functional.cross_entropy(own, torch.zeros(len(own), dtype=torch.long))
    right = functional.softplus(-own[:, 0]).mean()
    wrong = functional.softplus(torch.cat([own[:, 1:].flatten(), other])).mean()
    return choice + right + wrong


def _batch(clouds: Clouds, generator: torch.Generator) -> tuple[Tensor, Tensor]:
    """``[SHAPES, TURNS, POINTS, 3]`` of the category and ``[OTHERS, POINTS, 3]`` others."""
    real = round(SHAPES * clouds.real_share) if len(clouds.real) else 0
    upright = clouds.draw(SHAPES - real, POINTS)
    if real:
        upright = torch.cat([upright, _draw(clouds.real, real, generator)])
    upright = disturb(upright, generator)
    wrong = torch.rand(SHAPES, len(ROTATIONS) - 1, generator=generator).argsort(dim=1) + 1
    turns = torch.cat([torch.zeros(SHAPES, 1, dtype=torch.long), wrong[:, : TURNS - 1]], dim=1)
    own = torch.einsum("btij,bpj->btpi", ROTATIONS[turns], upright)
    others = disturb(_draw(clouds.others, OTHERS, generator), generator)
    turns = torch.randint(len(ROTATIONS), (OTHERS,), generator=generator)
    return own, torch.einsum("bij,bpj->bpi", ROTATIONS[turns], others)


def _draw(clouds: Tensor, count: int, generator: torch.Generator) -> Tensor:
    """``[count, POINTS, 3]`` of random clouds, other points of them each time."""
    shape = torch.randint(len(clouds), (count, 1), generator=generator)
    return clouds[shape, torch.randint(clouds.shape[1], (count, POINTS), generator=generator)]


def pool(clouds: Sequence[np.ndarray]) -> Tensor:
    """Point arrays ``[POOL, 3]`` of any size as normalised clouds ``[n, POOL, 3]``."""
    if not clouds:
        return torch.zeros(0, POOL, 3)
    return normalise(torch.as_tensor(np.stack(clouds), dtype=torch.float32))


def write_card(card: dict[str, Any], path: Path) -> None:
    """Write a model's card."""
    path.write_text(json.dumps(card, indent=2) + "\n", "utf-8")


def write_onnx(network: Discriminator, path: Path) -> None:
    """Write a network that takes any number of views ``[k, POINTS, 3]`` at a time."""
    count = torch.export.Dim("count", min=1, max=len(ROTATIONS))
    example, names = torch.zeros(2, POINTS, 3), ("views", "odds")
    write_network(fold_batch_norm(network), example, path, names, ({0: count},))


def measure(
    model: Model, real: Sequence[np.ndarray], others: Sequence[np.ndarray]
) -> dict[str, Any]:
    """How well a model's discriminator does on shapes that it has not seen.

    Args:
        model: with its discriminator.
        real: ``[n, 3]`` point clouds of the category, upright.
        others: of anything else, in any orientation.
    """
    ways = orientations()
    odds = np.array([model.discriminator.odds(cloud, ways) for cloud in real])
    strange = np.array([model.discriminator.odds(cloud, ways).max() for cloud in others])
    up = np.array([way.up == ways[0].up for way in ways])
    best = odds.argmax(axis=1)
    return {
        "shapes": len(real),
        "orientation_right": round(float((best == 0).mean()), 4),
        "up_right": round(float(up[best].mean()), 4),
        "others": len(others),
        "auroc": round(float((odds[:, 0][:, None] > strange).mean()), 4) if len(others) else None,
    }


def build(
    template: AffineTemplate | SkinnedTemplate, data: Data, steps: int, path: Path, cache: Path
) -> dict[str, Any]:
    """Train a category's discriminator and write it.

    Args:
        template: the category's.
        data: the shapes to learn from.
        steps: of training.
        path: of the ONNX file.
        cache: for sampled clouds.

    Returns:
        The card's ``discriminator``, not yet measured.
    """
    learn = [shape for shape in data.shapes if not shape.held_out]
    others = [*heaps(HEAPS, POOL, 0), *data.others(POOL, held_out=False)]
    real, strange = clouds_of(learn, cache, POOL), [samples.points for samples in others]
    share = BODY_REAL_SHARE if isinstance(template, SkinnedTemplate) else REAL_SHARE
    network = train(Clouds(drawn_from(template, 0), pool(real), pool(strange), share), steps)
    write_onnx(network, path)
    return {
        "digest": file_digest(path),
        "steps": steps,
        "data": {"realistic": len(learn), "others": len(others)},
    }


def drawn_by(model: Model, count: int) -> list[Samples]:
    """Samples of synthetic shapes of a model's category: clean ones, or bodies in clothes."""
    if isinstance(model, BodyModel):
        garments = Garments(partial=0.0, tilt=0.0)
        bodies = synthetic_bodies(model.template, garments, count, model.points)
        return [body.samples for body in bodies]
    assert isinstance(model, AffineModel)
    return synthetic_samples(model, count)[0]


def assess(model: Model, card: dict[str, Any], data: Data, cache: Path) -> None:
    """Fill in what a model's card says of its discriminator's accuracy, and its calibration."""
    held_out = [shape for shape in data.shapes if shape.held_out]
    drawn = drawn_by(model, 100)
    real = clouds_of(held_out, cache, POOL) or [samples.points for samples in drawn]
    strange = [s.points for s in (*heaps(50, POOL, 1), *data.others(POOL, held_out=True))]
    card["discriminator"]["measured"] = measure(model, real, strange)
    ordinary = [shape for shape in data.shapes if shape.info.get("core", True)]
    card["calibration"] = calibrate(model, ordinary, drawn)


def main() -> None:
    """Command line."""
    program = "python -m model_export.discriminate"
    parser = argparse.ArgumentParser(prog=program, description=__doc__)
    parser.add_argument("name", help="the category")
    parser.add_argument("--models", type=Path, default=SHIPPED, help="folder of its model")
    parser.add_argument("--realistic", type=Path, help="folder of real meshes, as for training")
    parser.add_argument(
        "--others", type=Path, nargs="*", default=[], help="folders of meshes of other kinds"
    )
    parser.add_argument("--but", help="regular expression: files there that are of the category")
    parser.add_argument("--cache", type=Path, default=Path("cache"), help="for sampled clouds")
    parser.add_argument("--steps", type=int, default=1500)
    parser.add_argument("--threads", type=int, help="CPU threads (default: all)")
    arguments = parser.parse_args()
    if arguments.threads:
        torch.set_num_threads(arguments.threads)
    data = Data.of(arguments.realistic, arguments.others, arguments.but)
    path = arguments.models / f"{arguments.name}.json"
    card = json.loads(path.read_text("utf-8"))
    template: AffineTemplate | SkinnedTemplate
    if card.get("kind") == BodyModel.kind:
        template = load_body()
    else:
        template = load_template(template_source(path, arguments.name))
    network = path.with_suffix(DISCRIMINATOR_SUFFIX)
    card["discriminator"] = build(template, data, arguments.steps, network, arguments.cache)
    write_card(card, path)
    model = load_model(path)
    assess(model, card, data, arguments.cache)
    write_card(card, path)
    model.verify()
    print(json.dumps({name: card[name] for name in ("discriminator", "calibration")}, indent=2))


if __name__ == "__main__":
    main()
