"""Train the body's point encoder: ``python -m model_export.train_body --realistic DIR``."""

from __future__ import annotations

import argparse
import dataclasses
import math
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from model_export.bodies import BodyBatch, SyntheticBodies
from model_export.bodyconfig import BodyConfig, load_body_config
from model_export.bodyerrors import joint_errors
from model_export.bodylosses import BodyAnswer, BodyLosses, draw_edits
from model_export.bodynet import BodyEncoder, spread_first
from model_export.realistic import RealisticShapes
from model_export.replay import Replayed
from model_export.runs import Run, go_on, load_checkpoint, seed_of
from service.encode.bodyoutputs import ANCHORS
from service.template.bodyfile import load_body
from service.template.skinned import SkinnedTemplate

VALIDATION_SEED = 20_000_003


class BodyTrainer(Run):
    """A run: its network, data and progress, resumable from a checkpoint."""

    def __init__(
        self,
        config: BodyConfig,
        template: SkinnedTemplate,
        realistic: RealisticShapes | None,
        device: str = "cpu",
        *,
        minutes: float | None = None,
        recorded: bool = True,
    ) -> None:
        """
        Args:
            config: of the run.
            template: the body.
            realistic: unlabelled bodies; None trains on synthetic ones alone.
            device: where to train.
            minutes: to train for; None for the configuration's steps.
            recorded: on a GPU, record a step and replay it.
        """
        super().__init__(config.steps, minutes, device)
        self.config, self.template, self.realistic = config, template, realistic
        torch.manual_seed(config.seed)
        self.bodies = SyntheticBodies(template, config.garments, config.seed, self.device)
        self.losses = BodyLosses(template, config.seed, self.device)
        usual = self.bodies.batch(256, 256).scale.log().mean().item()
        shape = config.width, config.depth, config.neighbours
        self.encoder = BodyEncoder(*shape, mean_log_scale=usual).to(self.device)
        self.real = round(config.batch * config.real_share) if realistic else 0
        gpu = self.device.type == "cuda"
        # Where a step is recorded, the learning rate has to be a place in memory.
        self.rate = torch.zeros((), device=self.device)
        self.optimizer = torch.optim.AdamW(
            self.encoder.parameters(), self.rate, weight_decay=config.decay,
            capturable=gpu, foreach=gpu,
        )  # fmt: skip
        self.learn = Replayed(self._learn) if gpu and recorded else self._learn
        self._names: list[str] = []
        self._block, self._drawn = -1, []

    def train_step(self) -> dict[str, Tensor]:
        """One optimiser step; the terms of the loss."""
        self.rate.fill_(self._learning_rate())
        values = self.learn(*self._next())
        self.step += 1
        return dict(zip(self._names, values.unbind(), strict=True))

    def _learn(self, real: Tensor, edits: Tensor, *columns: Tensor) -> Tensor:
        """A step on ``[b, n, 3]`` real clouds and the columns of labelled bodies; the terms."""
        config = self.config
        batch = BodyBatch(*columns)
        clouds = torch.cat([batch.points, real])
        self.encoder.train()
        with torch.autocast(self.device.type, torch.bfloat16, enabled=config.precision == "bf16"):
            outputs, parts, votes = self.encoder.answers(clouds)
        count = len(batch.points)
        answer = BodyAnswer.of(outputs[:count])
        terms = self.losses.synthetic(answer, batch, parts[:count], votes[:count], edits)
        if len(real):
            terms["sim"] = self.losses.similarity(BodyAnswer.of(outputs[count:]), real)
        weights = dataclasses.asdict(config.weights)
        loss = torch.stack([weights[name] * value for name, value in terms.items()]).sum()
        self.optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.encoder.parameters(), 1.0)
        self.optimizer.step()
        self._names = ["loss", *terms]
        return torch.stack([loss, *terms.values()]).detach()

    def _next(self) -> list[Tensor]:
        """What `_learn` takes at this step."""
        block, index = divmod(self.step, self.ahead)
        if block != self._block:
            self._block, self._drawn = block, self._draw(block)
        real, edits, batch = self._drawn
        labelled = self.config.batch - self.real
        rows = slice(labelled * index, labelled * (index + 1))
        clouds = real[self.real * index : self.real * (index + 1)]
        return [clouds, edits[rows], *batch.rows(rows).columns]

    @torch.no_grad()
    def _draw(self, block: int) -> tuple[Tensor, Tensor, BodyBatch]:
        """Real clouds, edits and labelled bodies of some steps; their numbers decide them."""
        config, seed = self.config, seed_of(self.config.seed, block)
        self.bodies.generator.manual_seed(seed)
        count = self.ahead * (config.batch - self.real)
        batch = ordered(self.bodies.batch(count, config.points))
        edits = draw_edits(count, self.bodies.generator)
        real = batch.points[:0]
        if self.realistic and self.real:
            size = self.ahead * self.real
            self.realistic.reseed(seed, block * size)
            real = self._real(size)
        return real, edits, batch

    def _real(self, count: int) -> Tensor:
        assert self.realistic is not None
        clouds = self.realistic.batch(count, self.config.points)
        clouds = clouds @ self.bodies.orientations(count).transpose(1, 2)
        order = spread_first(clouds, ANCHORS)
        return clouds.gather(1, order[..., None].expand(-1, -1, 3))

    def _learning_rate(self) -> float:
        config = self.config
        rise = min(1.0, (self.step + 1) / max(1, config.warmup))
        fall = 0.5 * (1 + math.cos(math.pi * self.share))
        return config.learning_rate * rise * (fall + 1e-3)

    def state(self) -> dict[str, Any]:
        """Everything that `restore` needs, as plain values and tensors."""
        return {
            "config": dataclasses.asdict(self.config),
            "template": self.template.digest,
            "encoder": self.encoder.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "step": self.step,
            "seconds": self.seconds,
            "place": self.place,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a checkpoint of the same configuration, made on the same kind of device."""
        self.encoder.load_state_dict(state["encoder"])
        self.optimizer.load_state_dict(state["optimizer"])
        for group in self.optimizer.param_groups:
            group["lr"] = self.rate
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


def run(trainer: BodyTrainer, folder: Path, every: int, until: int | None = None) -> None:
    """Train to the end, with checkpoints, log lines and validation figures every so often."""
    fresh = SyntheticBodies(
        trainer.template, trainer.config.garments, VALIDATION_SEED, trainer.device
    )
    batch = ordered(fresh.batch(192, trainer.config.points))

    def measure() -> tuple[dict[str, Any], str]:
        errors = joint_errors(trainer.encoder, trainer.losses, batch)
        figures = {name: round(value, 4) for name, value in errors.items()}
        return figures, ", ".join(f"{name} {value:.1f}" for name, value in errors.items())

    go_on(trainer, folder, every, measure, until)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.train_body", description=__doc__)
    parser.add_argument("--config", type=Path, help="YAML file (default: the shipped model's)")
    parser.add_argument("--body", type=Path, help="body file (default: the shipped body)")
    parser.add_argument(
        "--realistic", type=Path,
        help="folder of unlabelled real bodies, or file of clouds (model_export.realistic)",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, default=Path("runs/human"), help="folder of the run")
    parser.add_argument("--cache", type=Path, default=Path("cache"), help="for sampled clouds")
    parser.add_argument("--start-from", type=Path, help="checkpoint of another run to go on from")
    parser.add_argument("--resume", action="store_true", help="go on from the last checkpoint")
    parser.add_argument("--minutes", type=float, help="train so long, not a number of steps")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.add_argument("--eager", action="store_true", help="on a GPU: don't record a step")
    parser.add_argument("--threads", type=int, help="CPU threads (default: all)")
    parser.add_argument("--steps", type=int, help="instead of the configuration's")
    parser.add_argument("--every", type=int, default=500, help="steps between measurements")
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
    trainer = BodyTrainer(
        config, load_body(arguments.body), realistic, arguments.device, minutes=arguments.minutes,
        recorded=not arguments.eager,
    )  # fmt: skip
    if arguments.start_from:
        trainer.start_from(load_checkpoint(arguments.start_from))
    if arguments.resume:
        trainer.restore(load_checkpoint(arguments.out / "checkpoint.pt"))
    run(trainer, arguments.out, arguments.every)


if __name__ == "__main__":
    main()
