"""What training runs have in common: how far they are, where they run, checkpoints and logs."""

from __future__ import annotations

import json
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor
from tqdm import tqdm

CHECKPOINT_SECONDS = 60.0
LOOK = 20
"""Steps between looks at the loss: each look makes the host wait for the device."""
SMOOTH = 0.02


class Run(ABC):
    """A training run: a number of steps, or all that fit into a time.

    Attributes:
        steps: of the whole run, where no time is set.
        minutes: that the run may take; what depends on progress then goes by the time.
        step: how many are done.
        seconds: that they took.
    """

    def __init__(self, steps: int, minutes: float | None, device: torch.device | str) -> None:
        self.steps, self.minutes = steps, minutes
        self.device = torch.device(device)
        self.step, self.seconds = 0, 0.0

    @property
    def share(self) -> float:
        """What part of the run is done, from 0 to 1."""
        done = self.step / self.steps
        if self.minutes is not None:
            done = self.seconds / (60.0 * self.minutes)
        return min(1.0, done)

    @property
    def ahead(self) -> int:
        """Steps whose shapes are drawn together: a GPU has little to do for those of one."""
        return 16 if self.device.type == "cuda" else 1

    @property
    def place(self) -> str:
        """Where the run is, for its card."""
        if self.device.type == "cuda":
            return f"one {torch.cuda.get_device_name(self.device)}"
        return f"CPU, threads: {torch.get_num_threads()}"

    @abstractmethod
    def train_step(self) -> dict[str, Tensor]:
        """One optimiser step; the terms of the loss, always the same ones."""

    @abstractmethod
    def state(self) -> dict[str, Any]:
        """Everything that it takes to go on, as plain values and tensors."""


def seed_of(*numbers: int) -> int:
    """A seed that is as good as any other for each sequence of numbers."""
    return int(np.random.SeedSequence(numbers).generate_state(1, np.uint64)[0] >> 2)


def save_checkpoint(run: Run, folder: Path) -> None:
    """Write a run's state, so that there is a whole one at any time."""
    torch.save(run.state(), folder / "checkpoint.part")
    (folder / "checkpoint.part").replace(folder / "checkpoint.pt")


def load_checkpoint(path: Path) -> dict[str, Any]:
    """A run's state, its tensors on the CPU."""
    return torch.load(path, map_location="cpu")


def go_on(
    run: Run,
    folder: Path,
    every: int,
    measure: Callable[[], tuple[dict[str, Any], str]],
    until: int | None = None,
) -> None:
    """Train to the end.

    Args:
        run: to go on with.
        folder: where a checkpoint is written at least every minute, and `log.jsonl`.
        every: steps between measurements.
        measure: figures for the log, and how they read.
        until: step to stop at before the end.

    Raises:
        FloatingPointError: when the loss is not finite; the last checkpoint is from before that.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if run.step == 0:
        (folder / "log.jsonl").unlink(missing_ok=True)
    bar = tqdm(total=run.steps if run.minutes is None else None, initial=run.step,
               unit="step", mininterval=10.0)  # fmt: skip
    began, saved = time.monotonic() - run.seconds, run.seconds
    means = _Means()
    ended = run.share >= 1.0
    while not ended:
        means.add(run.train_step())
        run.seconds = time.monotonic() - began
        ended = run.share >= 1.0 or run.step == until
        measured = ended or run.step % every == 0
        if run.step % LOOK == 0:
            bar.set_postfix_str(f"loss {means.values(run.step)['loss']:.3g}", refresh=False)
        if measured or run.seconds - saved > CHECKPOINT_SECONDS:
            values = means.values(run.step)
            save_checkpoint(run, folder)
            saved = run.seconds
        bar.update()
        if measured:
            figures, said = measure()
            line = {"step": run.step, "seconds": round(run.seconds), **values, **figures}
            with (folder / "log.jsonl").open("a") as log:
                log.write(json.dumps(line) + "\n")
            bar.write(f"step {run.step}: {said}")
    bar.close()


class _Means:
    """Running means of the terms of the loss, kept on the device."""

    def __init__(self) -> None:
        self.names: list[str] = []
        self.kept: Tensor | None = None

    def add(self, terms: dict[str, Tensor]) -> None:
        new = torch.stack([value.detach() for value in terms.values()])
        self.names = list(terms)
        self.kept = new if self.kept is None else torch.lerp(self.kept, new, SMOOTH)

    def values(self, step: int) -> dict[str, float]:
        assert self.kept is not None
        values = dict(zip(self.names, self.kept.tolist(), strict=True))
        if not np.isfinite(list(values.values())).all():
            raise FloatingPointError(
                f"the loss is not finite at step {step}: {values}; "
                "--resume goes on from the last checkpoint"
            )
        return {name: round(value, 6) for name, value in values.items()}
