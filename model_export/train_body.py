"""Train the body's point encoder: ``python -m model_export.train_body --realistic DIR``."""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import time
from pathlib import Path
from typing import Any

import torch
from tqdm import tqdm

from model_export.bodies import BodyBatch, SyntheticBodies
from model_export.bodyconfig import BodyConfig, load_body_config
from model_export.bodylosses import BodyAnswer, BodyLosses
from model_export.bodynet import BodyEncoder, spread_first
from model_export.realistic import RealisticShapes
from service.encode.bodyoutputs import ANCHORS
from service.template.anatomy import PARENTS
from service.template.bodyfile import load_body
from service.template.skinned import SkinnedTemplate
from service.template.skinning import pose_joints

VALIDATION_SEED = 20_000_003
STATURE = 1.7
"""Metres: joint errors are given for a body that tall."""


class BodyTrainer:
    """A run: its network, data and progress, resumable from a checkpoint."""

    def __init__(
        self,
        config: BodyConfig,
        template: SkinnedTemplate,
        realistic: RealisticShapes | None,
        device: str = "cpu",
    ) -> None:
        """
        Args:
            config: of the run.
            template: the body.
            realistic: unlabelled bodies; None trains on synthetic ones alone.
            device: where to train.
        """
        self.config, self.template, self.realistic = config, template, realistic
        self.device = torch.device(device)
        torch.manual_seed(config.seed)
        self.bodies = SyntheticBodies(template, config.garments, config.seed, device)
        self.losses = BodyLosses(template, config.seed, device)
        usual = self.bodies.batch(256, 256).scale.log().mean().item()
        shape = config.width, config.depth, config.neighbours
        self.encoder = BodyEncoder(*shape, mean_log_scale=usual).to(self.device)
        self.optimizer = torch.optim.AdamW(
            self.encoder.parameters(), config.learning_rate, weight_decay=config.decay
        )
        self.step, self.seconds = 0, 0.0

    def train_step(self) -> dict[str, float]:
        """One optimiser step; the terms of the loss."""
        config = self.config
        for group in self.optimizer.param_groups:
            group["lr"] = self._learning_rate()
        size = config.points
        real = round(config.batch * config.real_share) if self.realistic else 0
        batch = ordered(self.bodies.batch(config.batch - real, size))
        clouds = batch.points
        if self.realistic and real:
            clouds = torch.cat([clouds, self._real(real, size)])
        self.encoder.train()
        with torch.autocast(self.device.type, torch.bfloat16, enabled=config.precision == "bf16"):
            outputs, parts, votes = self.encoder.answers(clouds)
        count = len(batch.points)
        answer = BodyAnswer.of(outputs[:count])
        terms = self.losses.synthetic(answer, batch, parts[:count], votes[:count])
        if real:
            terms["sim"] = self.losses.similarity(BodyAnswer.of(outputs[count:]), clouds[count:])
        weights = dataclasses.asdict(config.weights)
        loss = torch.stack([weights[name] * value for name, value in terms.items()]).sum()
        self.optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.encoder.parameters(), 1.0)
        self.optimizer.step()
        self.step += 1
        return {"loss": loss.item(), **{name: value.item() for name, value in terms.items()}}

    def _real(self, count: int, size: int) -> torch.Tensor:
        assert self.realistic is not None
        clouds = self.realistic.batch(count, size)
        clouds = clouds @ self.bodies.orientations(count).transpose(1, 2)
        order = spread_first(clouds, ANCHORS)
        return clouds.gather(1, order[..., None].expand(-1, -1, 3))

    def _learning_rate(self) -> float:
        config = self.config
        rise = min(1.0, (self.step + 1) / max(1, config.warmup))
        fall = 0.5 * (1 + math.cos(math.pi * min(1.0, self.step / config.steps)))
        return config.learning_rate * rise * (fall + 1e-3)

    def state(self) -> dict[str, Any]:
        """Everything that `restore` needs, as plain values and tensors."""
        return {
            "config": dataclasses.asdict(self.config),
            "template": self.template.digest,
            "encoder": self.encoder.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "random": [
                torch.get_rng_state(),
                self.bodies.generator.get_state(),
                self.losses.generator.get_state(),
            ],
            "step": self.step,
            "seconds": self.seconds,
            "place": self._place(),
        }

    def _place(self) -> str:
        if self.device.type == "cuda":
            return torch.cuda.get_device_name(self.device)
        return f"CPU, threads: {torch.get_num_threads()}"

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a checkpoint of the same configuration."""
        self.encoder.load_state_dict(state["encoder"])
        self.optimizer.load_state_dict(state["optimizer"])
        torch.set_rng_state(state["random"][0])
        self.bodies.generator.set_state(state["random"][1])
        self.losses.generator.set_state(state["random"][2])
        self.step, self.seconds = state["step"], state["seconds"]

    def start_from(self, state: dict[str, Any]) -> None:
        """Begin with the encoder of another run."""
        self.encoder.load_state_dict(state["encoder"])


def ordered(batch: BodyBatch) -> BodyBatch:
    """The same bodies, their anchors first."""
    order = spread_first(batch.points, ANCHORS)
    each = order[..., None].expand(-1, -1, 3)
    return dataclasses.replace(
        batch,
        points=batch.points.gather(1, each),
        normals=batch.normals.gather(1, each),
        parts=batch.parts.gather(1, order),
    )


@torch.no_grad()
def joint_errors(encoder: BodyEncoder, losses: BodyLosses, batch: BodyBatch) -> dict[str, float]:
    """Mean joint error in mm at a stature of 1.7 m, and median rotation error in degrees.

    ``votes`` are the joints as they are voted for, ``posed`` those of the answered pose, ``turn``
    is of the rotations in space.
    """
    encoder.eval()
    answer = BodyAnswer.of(torch.cat([encoder(chunk) for chunk in batch.points.split(32)]))
    rest = losses.joints + torch.einsum("jck,bk->bjc", losses.joint_dirs, answer.shape)
    placed = pose_joints(answer.rotations, rest, PARENTS)[1] - rest[:, :1]
    posed = answer.scale[:, None, None] * placed + answer.votes[:, :1]
    turned, _ = pose_joints(batch.rotations, batch.joints, PARENTS)
    metre = batch.scale[:, None]
    cosine = ((answer.turned.transpose(2, 3) @ turned).diagonal(dim1=2, dim2=3).sum(2) - 1) / 2
    return {
        "votes": 1000 * ((answer.votes - batch.joints).norm(dim=2) / metre).mean().item(),
        "posed": 1000 * ((posed - batch.joints).norm(dim=2) / metre).mean().item(),
        "turn": torch.rad2deg(torch.acos(cosine.clamp(-1, 1))).median().item(),
    }


def run(trainer: BodyTrainer, folder: Path, every: int, until: int | None = None) -> None:
    """Train to the end, with a checkpoint, a log line and validation figures every so often."""
    folder.mkdir(parents=True, exist_ok=True)
    if trainer.step == 0:
        (folder / "log.jsonl").unlink(missing_ok=True)
    fresh = SyntheticBodies(
        trainer.template, trainer.config.garments, VALIDATION_SEED, trainer.device
    )
    batch = ordered(fresh.batch(192, trainer.config.points))
    last = min(until or trainer.config.steps, trainer.config.steps)
    bar = tqdm(total=trainer.config.steps, initial=trainer.step, unit="step", mininterval=10.0)
    began = time.monotonic() - trainer.seconds
    means: dict[str, float] = {}
    while trainer.step < last:
        for name, value in trainer.train_step().items():
            means[name] = 0.98 * means.get(name, value) + 0.02 * value
        bar.update()
        if trainer.step % every == 0 or trainer.step == last:
            trainer.seconds = time.monotonic() - began
            torch.save(trainer.state(), folder / "checkpoint.part")
            (folder / "checkpoint.part").replace(folder / "checkpoint.pt")
            errors = joint_errors(trainer.encoder, trainer.losses, batch)
            line = {"step": trainer.step, "seconds": round(trainer.seconds), **means, **errors}
            with (folder / "log.jsonl").open("a") as log:
                log.write(json.dumps({k: round(v, 4) for k, v in line.items()}) + "\n")
            figures = ", ".join(f"{name} {value:.1f}" for name, value in errors.items())
            bar.write(f"step {trainer.step}: {figures}")
    bar.close()


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.train_body", description=__doc__)
    parser.add_argument("--config", type=Path, help="YAML file (default: the shipped model's)")
    parser.add_argument("--body", type=Path, help="body file (default: the shipped body)")
    parser.add_argument("--realistic", type=Path, help="folder of unlabelled real bodies")
    parser.add_argument("--out", type=Path, default=Path("runs/human"), help="folder of the run")
    parser.add_argument("--cache", type=Path, default=Path("cache"), help="for sampled clouds")
    parser.add_argument("--start-from", type=Path, help="checkpoint of another run to go on from")
    parser.add_argument("--resume", action="store_true", help="go on from the last checkpoint")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.add_argument("--threads", type=int, help="CPU threads (default: all)")
    parser.add_argument("--steps", type=int, help="instead of the configuration's")
    parser.add_argument("--every", type=int, default=500, help="steps between checkpoints")
    arguments = parser.parse_args()
    if arguments.threads:
        torch.set_num_threads(arguments.threads)
    try:
        config = load_body_config(arguments.config)
    except (OSError, ValueError) as error:
        parser.exit(1, f"{error}\n")
    if arguments.steps:
        config = dataclasses.replace(config, steps=arguments.steps)
    realistic = None
    if arguments.realistic:
        realistic = RealisticShapes(
            arguments.realistic, arguments.cache, config.seed, device=arguments.device
        )
        print(f"{len(realistic)} real bodies to train on, {len(realistic.skipped)} unreadable")
    trainer = BodyTrainer(config, load_body(arguments.body), realistic, arguments.device)
    if arguments.start_from:
        trainer.start_from(torch.load(arguments.start_from, map_location=arguments.device))
    if arguments.resume:
        trainer.restore(torch.load(arguments.out / "checkpoint.pt", map_location=arguments.device))
    run(trainer, arguments.out, arguments.every)


if __name__ == "__main__":
    main()
