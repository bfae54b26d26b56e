from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import torch

from model_export import runs
from model_export.runs import Run, go_on, load_checkpoint, seed_of


class Falling(Run):
    """A run whose loss is one over the step, and not finite from some step on."""

    def __init__(self, steps: int, minutes: float | None = None, breaks: int = 10**6) -> None:
        super().__init__(steps, minutes, "cpu")
        self.breaks = breaks

    def train_step(self) -> dict[str, torch.Tensor]:
        self.step += 1
        return {"loss": torch.tensor(1.0 / self.step if self.step < self.breaks else torch.nan)}

    def state(self) -> dict[str, Any]:
        return {"step": self.step, "seconds": self.seconds}


def measured() -> tuple[dict[str, Any], str]:
    return {"error": 3.0}, "off by 3"


def logged(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / "log.jsonl").read_text().splitlines()]


def test_a_run_ends_after_its_steps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = Falling(7)
    go_on(run, tmp_path, 3, measured)
    assert [line["step"] for line in logged(tmp_path)] == [3, 6, 7]
    assert logged(tmp_path)[0]["error"] == 3.0
    assert load_checkpoint(tmp_path / "checkpoint.pt")["step"] == 7
    assert "step 6: off by 3" in capsys.readouterr().out


def test_a_run_ends_when_its_time_is_over(tmp_path: Path) -> None:
    run = Falling(5, minutes=0.002)
    go_on(run, tmp_path, 10**6, measured)
    assert run.step > 5
    assert run.share == 1.0
    assert 0.1 < run.seconds < 5.0
    assert logged(tmp_path)[-1]["step"] == run.step
    # It is over for good.
    steps = run.step
    go_on(run, tmp_path, 1, measured)
    assert run.step == steps


def test_progress_is_that_of_the_steps_or_of_the_time() -> None:
    run = Falling(8)
    run.step, run.seconds = 2, 30.0
    assert run.share == 0.25
    run.minutes = 1.0
    assert run.share == 0.5


def test_checkpoints_are_written_between_measurements(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runs, "CHECKPOINT_SECONDS", -1.0)
    saved = []
    monkeypatch.setattr(runs, "save_checkpoint", lambda run, folder: saved.append(run.step))
    go_on(Falling(4), tmp_path, 3, measured)
    assert saved == [1, 2, 3, 4]
    assert [line["step"] for line in logged(tmp_path)] == [3, 4]


def test_a_loss_that_is_not_finite_ends_the_run_before_a_checkpoint(tmp_path: Path) -> None:
    with pytest.raises(FloatingPointError, match="not finite at step 6"):
        go_on(Falling(9, breaks=5), tmp_path, 3, measured)
    assert load_checkpoint(tmp_path / "checkpoint.pt")["step"] == 3


def test_seeds_differ_and_repeat() -> None:
    seeds = [seed_of(seed, block) for seed in range(20) for block in range(50)]
    assert len(set(seeds)) == 1000
    assert seeds[51] == seed_of(1, 1)
    assert all(0 <= seed < 2**62 for seed in seeds)


def test_a_cpu_says_how_many_threads() -> None:
    assert Falling(1).place.startswith("CPU, threads: ")
