"""Train a category's encoder: ``python -m model_export.train chair --realistic DIR``, or
``python -m model_export.train table.yaml --quick`` for a category of one's own.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import shutil
import time
from pathlib import Path
from typing import Any

import numpy as np
import torch
from tqdm import tqdm

from model_export.config import Config, config_of
from model_export.losses import Losses, draw_edit, total
from model_export.metrics import Recovery, recovery
from model_export.networks import Encoder, build_encoder
from model_export.realistic import RealisticShapes
from model_export.synthetic import Augmentation, Batch, SyntheticShapes
from service.template.affine import AffineTemplate
from service.template.loader import load_template

VALIDATION_SEED = 20_000_003


class Trainer:
    """A run: its networks, data and progress, resumable from a checkpoint."""

    def __init__(
        self,
        config: Config,
        realistic: RealisticShapes | None,
        device: str = "cpu",
        compiled: bool = False,
    ) -> None:
        """
        Args:
            config: of the run.
            realistic: unlabelled shapes; None trains on synthetic ones alone.
            device: where to train.
            compiled: let PyTorch compile the encoder: half again as fast, needs a C++ compiler.
        """
        self.config = config
        self.device = torch.device(device)
        self.template = load_template(config.template)
        require_scale_free(self.template)
        torch.manual_seed(config.seed)
        self.generator = torch.Generator(self.device).manual_seed(config.seed)
        self.synthetic = SyntheticShapes(
            self.template, config.augmentation, config.seed, config.log_share, self.device
        )
        self.realistic = realistic
        mean, spread = label_statistics(self.template, config)
        shape = config.shared, config.head, config.keypoints
        self.encoder = build_encoder(mean, spread, *shape).to(self.device)
        self.forward = torch.compile(self.encoder, dynamic=True) if compiled else self.encoder
        self.losses = Losses(self.template, spread.to(self.device), self.device)
        self.optimizer = torch.optim.Adam(self.encoder.parameters(), config.learning_rate)
        self.step = 0
        self.seconds = 0.0
        self.earlier: list[dict[str, Any]] = []

    def train_step(self) -> dict[str, float]:
        """One optimiser step; the terms of the loss."""
        config = self.config
        self._set_learning_rate()
        points = self._points()
        real = round(config.batch * config.real_share) if self.realistic else 0
        batch = self.synthetic.batch(config.batch - real, points)
        clouds = batch.points
        if self.realistic and real:
            shapes = self.realistic.batch(real, points)
            clouds = torch.cat([clouds, shapes])
        self.encoder.train()
        with torch.autocast(self.device.type, torch.bfloat16, enabled=config.precision == "bf16"):
            outputs = self.forward(clouds)
        terms = self._terms(outputs.float(), batch, clouds)
        loss = total(terms, config.weights)
        self.optimizer.zero_grad()
        loss.backward()
        self.optimizer.step()
        self.step += 1
        return {"loss": loss.item(), **{name: value.item() for name, value in terms.items()}}

    def _terms(
        self, outputs: torch.Tensor, batch: Batch, clouds: torch.Tensor
    ) -> dict[str, torch.Tensor]:
        count = len(batch.points)
        factors = None
        if self.config.editing:
            factors = draw_edit(count, len(self.template.parameters), self.generator, self.device)
        terms = self.losses.synthetic(outputs[:count], batch, factors)
        if len(clouds) > count and self.config.weights.gamma:
            terms["sim"] = self.losses.similarity(outputs[count:], clouds[count:])
        return terms

    def _points(self) -> int:
        """Points a cloud at this step: log-uniform in the range, then the served size."""
        config = self.config
        if self.step >= round(config.steps * (1 - config.final_share)):
            return config.final_points
        low, high = config.points
        draw = torch.rand((), generator=self.generator, device=self.device).item()
        return round(low * (high / low) ** draw)

    def _set_learning_rate(self) -> None:
        rate = self.config.learning_rate
        if self.config.cosine:
            rate *= 0.5 * (1 + math.cos(math.pi * self.step / self.config.steps)) + 1e-3
        for group in self.optimizer.param_groups:
            group["lr"] = rate

    def state(self) -> dict[str, Any]:
        """Everything that `restore` needs, as plain values and tensors."""
        return {
            "config": dataclasses.asdict(self.config),
            "encoder": self.encoder.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "random": [self.generator.get_state(), torch.get_rng_state()],
            "synthetic": [self.synthetic.generator.get_state(), _rng_state(self.synthetic.rng)],
            "realistic": _rng_state(self.realistic.rng) if self.realistic else None,
            "order": list(self.realistic.order) if self.realistic else [],
            "step": self.step,
            "seconds": self.seconds,
            "place": self._place(),
            "earlier": self.earlier,
        }

    def _place(self) -> str:
        if self.device.type == "cuda":
            return torch.cuda.get_device_name(self.device)
        return f"CPU, {torch.get_num_threads()} threads"

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a checkpoint of the same configuration."""
        self.encoder.load_state_dict(state["encoder"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.generator.set_state(state["random"][0])
        torch.set_rng_state(state["random"][1])
        self.synthetic.generator.set_state(state["synthetic"][0])
        self.synthetic.rng.bit_generator.state = json.loads(state["synthetic"][1])
        if self.realistic and state["realistic"]:
            self.realistic.rng.bit_generator.state = json.loads(state["realistic"])
            self.realistic.order = list(state.get("order", []))
        self.step, self.seconds = state["step"], state["seconds"]
        self.earlier = state["earlier"]

    def start_from(self, state: dict[str, Any]) -> None:
        """Begin with the encoder of another run, whose settings are kept for the card."""
        self.encoder.load_state_dict(state["encoder"])
        own = {name: state[name] for name in ("config", "step", "seconds", "place")}
        self.earlier = [*state["earlier"], own]


def _rng_state(rng: np.random.Generator) -> str:
    return json.dumps(rng.bit_generator.state)


def require_scale_free(template: AffineTemplate) -> None:
    """Refuse constant lengths: an upload's scale is unknown, so nothing could infer them.

    Raises:
        ValueError: when a vertex does not vanish with the parameters.
    """
    if np.abs(template.base).max() > 0.0:
        raise ValueError(
            f"the template {template.name!r} has a constant length; make it a parameter: "
            "an upload's scale is not known, so a fixed number of metres can't be recognised"
        )


def label_statistics(template: AffineTemplate, config: Config) -> tuple[torch.Tensor, torch.Tensor]:
    """``[d + 3 + K]`` mean and standard deviation of normalised labels; 0 and 1 for log odds."""
    shapes = SyntheticShapes(template, config.augmentation, config.seed + 1, config.log_share)
    labels = shapes.batch(4096 // 4, 256).labels
    odds = torch.zeros(len(template.present))
    mean, spread = labels.mean(dim=0), labels.std(dim=0).clamp_min(1e-3)
    return torch.cat([mean, odds]), torch.cat([spread, odds + 1.0])


@torch.no_grad()
def predict(encoder: Encoder, points: torch.Tensor) -> np.ndarray:
    """``[n, d + 3 + K]`` outputs in evaluation mode."""
    encoder.eval()
    chunks = [encoder(chunk) for chunk in points.split(25)]
    return torch.cat(chunks).cpu().numpy()


def validation_set(template: AffineTemplate, count: int) -> Batch:
    """The same clean shapes in every run, as many points as are served."""
    shapes = SyntheticShapes(template, Augmentation.none(), VALIDATION_SEED)
    batches = [shapes.batch(50, template.points) for _ in range(count // 50)]
    return Batch(*(torch.cat(column) for column in zip(*map(_columns, batches), strict=True)))


def _columns(batch: Batch) -> tuple[torch.Tensor, ...]:
    return batch.points, batch.parameters, batch.translation, batch.variant


def validate(encoder: Encoder, template: AffineTemplate, batch: Batch) -> Recovery:
    """B1 of the encoder alone."""
    device = encoder.mean.device
    predicted = predict(encoder, batch.points.to(device))
    return recovery(template, predicted, batch.labels.numpy(), batch.variant.numpy())


def run(trainer: Trainer, folder: Path, every: int = 1000, until: int | None = None) -> Recovery:
    """Train to the end, with a checkpoint, a log line and validation figures every so often."""
    _prepare(trainer, folder)
    batch = validation_set(trainer.template, 200)
    last = min(until or trainer.config.steps, trainer.config.steps)
    bar = tqdm(total=trainer.config.steps, initial=trainer.step, unit="step", mininterval=2.0)
    began, result = time.monotonic() - trainer.seconds, None
    means: dict[str, float] = {}
    shown = "not measured yet"
    while trainer.step < last:
        for name, value in trainer.train_step().items():
            means[name] = 0.98 * means.get(name, value) + 0.02 * value
        bar.update()
        if trainer.step % 20 == 0:
            bar.set_postfix_str(f"loss {means['loss']:.3g}, within {shown}", refresh=False)
        if trainer.step % every == 0 or trainer.step == last:
            trainer.seconds = time.monotonic() - began
            result = validate(trainer.encoder, trainer.template, batch)
            torch.save(trainer.state(), folder / "checkpoint.part")
            (folder / "checkpoint.part").replace(folder / "checkpoint.pt")
            line = {"step": trainer.step, "seconds": round(trainer.seconds), **means,
                    "within": result.within, "edited": result.edited,
                    "variants": result.variants}  # fmt: skip
            with (folder / "log.jsonl").open("a") as log:
                log.write(json.dumps(line) + "\n")
            shown = f"{result.row()} %"
            bar.write(f"step {trainer.step}: vertices within .01/.02/.03: {shown}")
    bar.close()
    return result or validate(trainer.encoder, trainer.template, batch)


def template_copy(folder: Path, template: str) -> Path:
    """Where a run keeps the template file that it trains."""
    return folder / Path(template).name


def require_same_template(folder: Path, template: str) -> None:
    """Refuse to go on with a run in ``folder`` whose template file has changed since it began.

    Raises:
        ValueError: when it has.
    """
    source, copy = Path(template), template_copy(folder, template)
    if copy.is_file() and source.is_file() and copy.read_bytes() != source.read_bytes():
        raise ValueError(
            f"{source} has changed since the run in {folder} began: start anew, without --resume"
        )


def _prepare(trainer: Trainer, folder: Path) -> None:
    """Make a run's folder, with its template file in it and without a former run's log."""
    folder.mkdir(parents=True, exist_ok=True)
    source = Path(trainer.config.template)
    copy = template_copy(folder, trainer.config.template)
    if source.is_file() and copy.resolve() != source.resolve():
        shutil.copyfile(source, copy)
    if trainer.step == 0:
        (folder / "log.jsonl").unlink(missing_ok=True)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.train", description=__doc__)
    parser.add_argument(
        "config",
        help="a template file (table.yaml), or a configuration: built-in name or YAML file",
    )
    parser.add_argument("--quick", action="store_true", help="a template file in minutes, on a CPU")
    parser.add_argument("--realistic", type=Path, help="folder of unlabelled real meshes")
    parser.add_argument("--out", type=Path, help="folder of the run (default runs/<config>)")
    parser.add_argument("--cache", type=Path, default=Path("cache"), help="for sampled clouds")
    parser.add_argument("--start-from", type=Path, help="checkpoint of another run to go on from")
    parser.add_argument("--resume", action="store_true", help="go on from the last checkpoint")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.add_argument("--threads", type=int, help="CPU threads (default: all)")
    parser.add_argument("--compile", action="store_true", help="faster; needs a C++ compiler")
    parser.add_argument("--steps", type=int, help="instead of the configuration's")
    parser.add_argument("--seed", type=int, help="instead of the configuration's")
    parser.add_argument(
        "--every", type=int, help="steps between checkpoints (default: at most 1000)"
    )
    arguments = parser.parse_args()
    if arguments.threads:
        torch.set_num_threads(arguments.threads)
    try:
        config = config_of(
            arguments.config, arguments.quick, steps=arguments.steps, seed=arguments.seed
        )
    except (OSError, ValueError) as error:
        parser.exit(1, f"{error}\n")
    realistic = None
    if arguments.realistic:
        realistic = RealisticShapes(
            arguments.realistic, arguments.cache, config.seed, device=arguments.device
        )
        print(f"{len(realistic)} real shapes to train on, {len(realistic.skipped)} unreadable")
    trainer = Trainer(config, realistic, arguments.device, arguments.compile)
    folder = arguments.out or Path("runs") / Path(arguments.config).stem
    if arguments.start_from:
        trainer.start_from(torch.load(arguments.start_from, map_location=arguments.device))
    if arguments.resume:
        require_same_template(folder, config.template)
        state = torch.load(folder / "checkpoint.pt", map_location=arguments.device)
        trainer.restore(state)
    run(trainer, folder, arguments.every or min(1000, max(1, config.steps // 12)))


if __name__ == "__main__":
    main()
