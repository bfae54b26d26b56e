"""Train a category's encoder: ``python -m model_export.train chair --realistic DIR``, or
``python -m model_export.train table.yaml --quick`` for a category of one's own.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from model_export.config import Config, config_of
from model_export.labels import label_statistics, require_scale_free
from model_export.losses import Losses, draw_edit, total
from model_export.metrics import Recovery
from model_export.networks import build_encoder
from model_export.realistic import RealisticShapes
from model_export.runs import Run, go_on, load_checkpoint, seed_of
from model_export.synthetic import Batch, SyntheticShapes
from model_export.templatecopy import keep_template, require_same_template
from model_export.validation import validate, validation_set
from service.template.loader import load_template


@dataclasses.dataclass(frozen=True)
class Drawn:
    """What one or more steps see: labelled shapes, the edits of them, and real clouds."""

    batch: Batch
    factors: Tensor
    real: Tensor


class Trainer(Run):
    """A run: its networks, data and progress, resumable from a checkpoint."""

    def __init__(
        self,
        config: Config,
        realistic: RealisticShapes | None,
        device: str = "cpu",
        *,
        minutes: float | None = None,
        compiled: bool = False,
    ) -> None:
        """
        Args:
            config: of the run.
            realistic: unlabelled shapes; None trains on synthetic ones alone.
            device: where to train.
            minutes: to train for; None for the configuration's steps.
            compiled: let PyTorch compile the encoder: half again as fast, needs a C++ compiler.
        """
        super().__init__(config.steps, minutes, device)
        self.config = config
        self.template = load_template(config.template)
        require_scale_free(self.template)
        torch.manual_seed(config.seed)
        self.synthetic = SyntheticShapes(
            self.template, config.augmentation, config.seed, config.log_share, self.device
        )
        self.realistic = realistic
        self.real = round(config.batch * config.real_share) if realistic else 0
        mean, spread = label_statistics(self.template, config)
        shape = config.shared, config.head, config.keypoints
        self.encoder = build_encoder(mean, spread, *shape).to(self.device)
        self.forward = torch.compile(self.encoder, dynamic=True) if compiled else self.encoder
        self.losses = Losses(
            self.template, spread.to(self.device), self.device, edit=config.edit, norm=config.norm
        )
        self.optimizer = torch.optim.Adam(
            self.encoder.parameters(), config.learning_rate, fused=self.device.type == "cuda"
        )
        self.earlier: list[dict[str, Any]] = []
        self._block = -1

    def train_step(self) -> dict[str, Tensor]:
        """One optimiser step; the terms of the loss."""
        config = self.config
        self._set_learning_rate()
        drawn = self._next()
        clouds = torch.cat([drawn.batch.points, drawn.real])
        self.encoder.train()
        terms = self._terms(self._encode(clouds), drawn)
        loss = total(terms, config.weights)
        self.optimizer.zero_grad()
        loss.backward()
        self.optimizer.step()
        self.step += 1
        return {"loss": loss, **terms}

    def _encode(self, clouds: Tensor) -> Tensor:
        half = self.config.precision == "bf16"
        with torch.autocast(self.device.type, torch.bfloat16, enabled=half):
            outputs: Tensor = self.forward(clouds)
        return outputs.float()

    def _encode_again(self, clouds: Tensor) -> Tensor:
        """Outputs for clouds of predictions, which are not to enter the running statistics."""
        norms = [layer for layer in self.encoder.modules() if isinstance(layer, nn.BatchNorm1d)]
        kept = [(norm, norm.momentum) for norm in norms]
        for norm in norms:
            norm.momentum = 0.0
        outputs = self._encode(clouds)
        for norm, momentum in kept:
            norm.momentum = momentum
        return outputs

    def _terms(self, outputs: Tensor, drawn: Drawn) -> dict[str, Tensor]:
        count = len(drawn.batch.points)
        factors = drawn.factors if self.config.editing else None
        terms = self.losses.synthetic(outputs[:count], drawn.batch, factors, self._encode_again)
        if len(drawn.real) and self.config.weights.gamma:
            points = self.config.similarity_points
            terms["sim"] = self.losses.similarity(outputs[count:], drawn.real, points)
        return terms

    def _next(self) -> Drawn:
        """What this step sees."""
        block, index = divmod(self.step, self.ahead)
        if block != self._block:
            self._block, self._drawn = block, self._draw(block)
        labelled = self.config.batch - self.real
        rows = slice(labelled * index, labelled * (index + 1))
        real = self._drawn.real[self.real * index : self.real * (index + 1)]
        return Drawn(self._drawn.batch.rows(rows), self._drawn.factors[rows], real)

    def _draw(self, block: int) -> Drawn:
        """What the steps of a block see, decided by its number: so a run can go on anywhere."""
        seed = seed_of(self.config.seed, block)
        torch.manual_seed(seed)  # of the samples that the similarity loss draws, too
        self.synthetic.reseed(seed)
        points = self._points()
        count = self.ahead * (self.config.batch - self.real)
        batch = self.synthetic.batch(count, points)
        size, generator = len(self.template.parameters), self.synthetic.generator
        factors = draw_edit(count, size, generator, self.device)
        real = batch.points[:0]
        if self.realistic and self.real:
            clouds = self.ahead * self.real
            self.realistic.reseed(seed, block * clouds)
            real = self.realistic.batch(clouds, points)
        return Drawn(batch, factors, real)

    def _points(self) -> int:
        """Points a cloud at this step: log-uniform in the range, then the served size."""
        config = self.config
        if self.share >= 1 - config.final_share:
            return config.final_points
        low, high = config.points
        return round(low * (high / low) ** self.synthetic.rng.random())

    def _set_learning_rate(self) -> None:
        rate = self.config.learning_rate
        if self.config.cosine:
            rate *= 0.5 * (1 + math.cos(math.pi * self.share)) + 1e-3
        for group in self.optimizer.param_groups:
            group["lr"] = rate

    def state(self) -> dict[str, Any]:
        """Everything that `restore` needs, as plain values and tensors."""
        return {
            "config": dataclasses.asdict(self.config),
            "encoder": self.encoder.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "step": self.step,
            "seconds": self.seconds,
            "place": self.place,
            "earlier": self.earlier,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a checkpoint of the same configuration."""
        self.encoder.load_state_dict(state["encoder"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.step, self.seconds = state["step"], state["seconds"]
        self.earlier = state["earlier"]

    def start_from(self, state: dict[str, Any]) -> None:
        """Begin with the encoder of another run, whose settings are kept for the card."""
        self.encoder.load_state_dict(state["encoder"])
        own = {name: state[name] for name in ("config", "step", "seconds", "place")}
        self.earlier = [*state["earlier"], own]


def run(trainer: Trainer, folder: Path, every: int = 1000, until: int | None = None) -> Recovery:
    """Train to the end, with checkpoints, log lines and validation figures every so often."""
    keep_template(folder, trainer.config.template)
    batch = validation_set(trainer.template, 200)
    results: list[Recovery] = []

    def measure() -> tuple[dict[str, Any], str]:
        result = validate(trainer.encoder, trainer.template, batch)
        results.append(result)
        figures = {"within": result.within, "edited": result.edited, "variants": result.variants}
        return figures, f"vertices within .01/.02/.03: {result.row()} %"

    go_on(trainer, folder, every, measure, until)
    if not results:
        measure()
    return results[-1]


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.train", description=__doc__)
    parser.add_argument(
        "config",
        help="a template file (table.yaml), or a configuration: built-in name or YAML file",
    )
    parser.add_argument("--quick", action="store_true", help="a template file in minutes, on a CPU")
    parser.add_argument(
        "--realistic", type=Path,
        help="folder of unlabelled real meshes, or file of clouds (model_export.realistic)",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, help="folder of the run (default runs/<config>)")
    parser.add_argument("--cache", type=Path, default=Path("cache"), help="for sampled clouds")
    parser.add_argument("--start-from", type=Path, help="checkpoint of another run to go on from")
    parser.add_argument("--resume", action="store_true", help="go on from the last checkpoint")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.add_argument("--threads", type=int, help="CPU threads (default: all)")
    parser.add_argument("--compile", action="store_true", help="faster; needs a C++ compiler")
    parser.add_argument("--minutes", type=float, help="train so long, not a number of steps")
    parser.add_argument("--steps", type=int, help="instead of the configuration's")
    parser.add_argument("--seed", type=int, help="instead of the configuration's")
    parser.add_argument(
        "--every", type=int, help="steps between measurements (default: at most 1000)"
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
    trainer = Trainer(
        config, realistic, arguments.device, minutes=arguments.minutes, compiled=arguments.compile
    )
    folder = arguments.out or Path("runs") / Path(arguments.config).stem
    if arguments.start_from:
        trainer.start_from(load_checkpoint(arguments.start_from))
    if arguments.resume:
        require_same_template(folder, config.template)
        trainer.restore(load_checkpoint(folder / "checkpoint.pt"))
    run(trainer, folder, arguments.every or min(1000, max(1, config.steps // 12)))


if __name__ == "__main__":
    main()
