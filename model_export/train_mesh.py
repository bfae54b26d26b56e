"""Train the body's mesh encoder: ``python -m model_export.train_mesh``, then export it likewise."""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from model_export.bodylosses import geodesic_squared, parents_on
from model_export.meshbodies import MeshBodies
from model_export.meshnet import MeshNet, region_middles
from model_export.onnxfile import write_network
from model_export.runs import Run, go_on, load_checkpoint, save_checkpoint, seed_of
from service.template.anatomy import JOINTS
from service.template.bodyfile import load_body
from service.template.skinned import SHAPES, SkinnedTemplate
from service.template.skinning import orthonormal

RATE, WARMUP = 3e-4, 100
LAST = 0.1
"""What the last layer's learning rate is of the others': it has thousands of inputs."""
RIDGE = 1e-4
"""Pull of the last layer towards what it is, relative to the mean square of a body's features."""
TEST_SEED = 20_000_003


def turns_of(outputs: Tensor) -> Tensor:
    """``[B, 24, 3, 3]`` rotations in space of the network's outputs."""
    return orthonormal(outputs[:, : 6 * len(JOINTS)].unflatten(1, (len(JOINTS), 6)))


def loss_of(outputs: Tensor, turned: Tensor, shape: Tensor) -> Tensor:
    """Squared geodesic distance of the rotations (section 4.3), and squared error of the shape."""
    own = turns_of(outputs)
    parents = parents_on(own.device)
    local, truth = (t.index_select(1, parents).transpose(2, 3) @ t[:, 1:] for t in (own, turned))
    angles = geodesic_squared(own, turned).mean() + geodesic_squared(local, truth).mean()
    return angles + 0.1 * (outputs[:, -SHAPES:] - shape).square().mean()


class MeshTrainer(Run):
    """A run: its network, data and progress, resumable from a checkpoint."""

    def __init__(
        self,
        template: SkinnedTemplate,
        steps: int,
        batch: int,
        device: str = "cpu",
        minutes: float | None = None,
        seed: int = 0,
    ) -> None:
        """
        Args:
            template: the body.
            steps: of the run.
            batch: bodies a step.
            device: where to train.
            minutes: to train for, instead of the steps.
            seed: of everything random.
        """
        super().__init__(steps, minutes, device)
        self.template, self.batch, self.seed = template, batch, seed
        torch.manual_seed(seed)
        self.bodies = MeshBodies(template, seed, self.device)
        self.middles = region_middles(template)
        self.network = MeshNet(template.faces, len(template.rest), self.middles).to(self.device)
        last = list(self.network.last.parameters())
        others = [*self.network.first.parameters(), *self.network.convolutions.parameters()]
        self.optimizer = torch.optim.AdamW(
            [{"params": others}, {"params": last}], RATE, weight_decay=1e-3
        )
        self._block = -1

    def train_step(self) -> dict[str, Tensor]:
        """One optimiser step; the loss."""
        fall = 0.5 + 0.5 * math.cos(math.pi * self.share)
        rate = RATE * min(1.0, (self.step + 1) / WARMUP) * (fall + 1e-3)
        for group, factor in zip(self.optimizer.param_groups, (1.0, LAST), strict=True):
            group["lr"] = rate * factor
        vertices, turned, shape = self._next()
        loss = loss_of(self.network(vertices), turned, shape)
        self.optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 1.0)
        self.optimizer.step()
        self.step += 1
        return {"loss": loss}

    def _next(self) -> tuple[Tensor, ...]:
        """The bodies of this step; its number decides them."""
        block, index = divmod(self.step, self.ahead)
        if block != self._block:
            self.bodies.generator.manual_seed(seed_of(self.seed, block))
            self._block, self._drawn = block, self.bodies.batch(self.ahead * self.batch)
        rows = slice(self.batch * index, self.batch * (index + 1))
        return tuple(column[rows] for column in self._drawn)

    def state(self) -> dict[str, Any]:
        """Everything that `restore` needs, as plain values and tensors."""
        return {
            "network": self.network.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "template": self.template.digest,
            "middles": self.middles.tolist(),
            "step": self.step,
            "batch": self.batch,
            "seconds": self.seconds,
            "place": self.place,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a checkpoint of the same body."""
        self.network.load_state_dict(state["network"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.step, self.seconds = state["step"], state["seconds"]


def network_of(state: dict[str, Any], template: SkinnedTemplate) -> MeshNet:
    """The network of a checkpoint, in evaluation mode."""
    network = MeshNet(template.faces, len(template.rest), np.array(state["middles"]))
    network.load_state_dict(state["network"])
    return network.eval()


def run(
    trainer: MeshTrainer, folder: Path, every: int, fitted: int, until: int | None = None
) -> None:
    """Train to the end; before and after, the last layer is fitted to so many bodies."""
    began = time.monotonic() - trainer.seconds
    if trainer.step == 0:
        fit_last(trainer.network, trainer.bodies, fitted, 16 * trainer.ahead)
        trainer.seconds = time.monotonic() - began

    def measure() -> tuple[dict[str, Any], str]:
        error = median_error(trainer.network, trainer.template, 50)
        return {"turn": round(error, 3)}, f"rotations are off by {error:.2f} degrees"

    print(f"step {trainer.step}: {measure()[1]}")
    go_on(trainer, folder, every, measure, until)
    if trainer.share == 1.0:
        fit_last(trainer.network, trainer.bodies, fitted, 16 * trainer.ahead)
        trainer.seconds = time.monotonic() - began
        save_checkpoint(trainer, folder)
        print(f"the last layer fitted: {measure()[1]}")


@torch.no_grad()
def fit_last(network: MeshNet, bodies: MeshBodies, count: int, chunk: int) -> None:
    """Fit the last layer, in place, to ``count`` fresh bodies, ``chunk`` drawn at a time: a ridge
    regression of what it lacks.

    Solved over the bodies, which are fewer than the features.
    """
    features, gaps = [], []
    for _ in range(max(1, count // chunk)):
        vertices, turned, shape = bodies.batch(chunk)
        pooled = network.pooled(vertices)
        columns = turned[..., :2].transpose(2, 3).flatten(1)
        features.append(pooled.double())
        gaps.append((torch.cat([columns, shape], dim=1) - network.answer(pooled)).double())
    x, y = torch.cat(features), torch.cat(gaps)
    center, middle = x.mean(dim=0), y.mean(dim=0)
    gram = (x - center) @ (x - center).T
    gram.diagonal().add_(RIDGE * gram.diagonal().mean())
    weight = (x - center).T @ torch.linalg.solve(gram, y - middle)
    network.last.weight += weight.T.float()
    network.last.bias += (middle - center @ weight).float()


def write_onnx(network: MeshNet, count: int, path: Path) -> None:
    """Write the network: input ``vertices [1, V, 3]``, output ``outputs``."""
    write_network(network, 0.1 * torch.randn(1, count, 3), path, ("vertices", "outputs"))


@torch.no_grad()
def median_error(network: MeshNet, template: SkinnedTemplate, count: int) -> float:
    """Median angle in degrees between answered and true rotations in space of fresh bodies."""
    bodies = MeshBodies(template, TEST_SEED, network.seen.device)
    angles = []
    for _ in range(count):
        vertices, turned, _ = bodies.batch(1)
        angles.append(geodesic_squared(turns_of(network(vertices)), turned).sqrt())
    return float(np.degrees(torch.cat(angles).median().item()))


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.train_mesh", description=__doc__)
    parser.add_argument("--body", type=Path, help="body file (default: the shipped body)")
    parser.add_argument("--out", type=Path, default=Path("runs/human-mesh"), help="of the run")
    parser.add_argument("--steps", type=int, default=1200)
    parser.add_argument("--batch", type=int, default=4)
    parser.add_argument("--fitted", type=int, default=960, help="bodies to fit the last layer to")
    parser.add_argument("--minutes", type=float, help="train so long, not a number of steps")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.add_argument("--threads", type=int, help="CPU threads (default: all)")
    parser.add_argument("--every", type=int, default=500, help="steps between measurements")
    parser.add_argument("--resume", action="store_true", help="go on from the last checkpoint")
    arguments = parser.parse_args()
    if arguments.threads:
        torch.set_num_threads(arguments.threads)
    trainer = MeshTrainer(
        load_body(arguments.body), arguments.steps, arguments.batch, arguments.device,
        arguments.minutes,
    )  # fmt: skip
    if arguments.resume:
        trainer.restore(load_checkpoint(arguments.out / "checkpoint.pt"))
    run(trainer, arguments.out, arguments.every, arguments.fitted)


if __name__ == "__main__":
    main()
