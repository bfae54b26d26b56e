from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from model_export import train
from model_export.config import Config
from model_export.losses import Weights
from model_export.realistic import RealisticShapes
from model_export.synthetic import Augmentation
from model_export.train import Trainer
from model_export.validation import validate, validation_set


@pytest.fixture
def realistic(meshes: Path, tmp_path: Path) -> RealisticShapes:
    return RealisticShapes(meshes, tmp_path / "cache", seed=5)


def same(first: Any, second: Any) -> bool:
    """Whether two checkpoints are equal to the bit."""
    if isinstance(first, torch.Tensor):
        return torch.equal(first, second)
    if isinstance(first, dict):
        return first.keys() == second.keys() and all(same(first[k], second[k]) for k in first)
    if isinstance(first, list | tuple):
        return len(first) == len(second) and all(map(same, first, second))
    return bool(first == second)


def test_training_lowers_the_loss_and_the_error(small_config: Config) -> None:
    trainer = Trainer(replace(small_config, steps=150), None)
    batch = validation_set(trainer.template, 100)
    before = validate(trainer.encoder, trainer.template, batch)
    losses = [trainer.train_step()["loss"].item() for _ in range(150)]
    after = validate(trainer.encoder, trainer.template, batch)
    assert np.mean(losses[-15:]) < 0.6 * np.mean(losses[:15])
    assert after.error.mean() < 0.7 * before.error.mean()
    assert after.within[2] > before.within[2]


def test_a_resumed_run_goes_on_as_if_it_had_not_stopped(
    small_config: Config, meshes: Path, tmp_path: Path
) -> None:
    config = replace(small_config, cosine=True, augmentation=Augmentation(clutter=0.3))

    def trainer() -> Trainer:
        return Trainer(config, RealisticShapes(meshes, tmp_path / "cache", config.seed))

    whole = trainer()
    expected = [whole.train_step() for _ in range(12)]
    first = trainer()
    steps = [first.train_step() for _ in range(5)]
    torch.save(first.state(), tmp_path / "checkpoint.pt")
    for _ in range(3):
        first.train_step()
    second = trainer()
    second.restore(torch.load(tmp_path / "checkpoint.pt", weights_only=True))
    steps += [second.train_step() for _ in range(7)]
    assert steps == expected
    assert same(second.state(), whole.state())


def test_the_seed_decides_the_run(small_config: Config) -> None:
    first, again = (Trainer(small_config, None) for _ in range(2))
    results = [[trainer.train_step() for _ in range(3)] for trainer in (first, again)]
    assert results[0] == results[1]
    other = Trainer(replace(small_config, seed=6), None)
    assert other.train_step() != results[0][0]


def test_half_of_each_batch_is_real(
    small_config: Config, realistic: RealisticShapes, monkeypatch: pytest.MonkeyPatch
) -> None:
    trainer = Trainer(replace(small_config, batch=16), realistic)
    sizes = []
    forward = trainer.forward

    def spy(clouds: torch.Tensor) -> torch.Tensor:
        sizes.append(tuple(clouds.shape))
        return forward(clouds)

    trainer.forward = spy  # type: ignore[assignment]
    drawn = []
    for shapes in (trainer.synthetic, realistic):
        batch = shapes.batch
        monkeypatch.setattr(
            shapes, "batch", lambda n, points, b=batch: (drawn.append(n), b(n, points))[1]
        )
    terms = trainer.train_step()
    assert drawn == [8, 8]
    assert sizes[0][0] == 16
    assert set(terms) == {"loss", "sem", "rec", "sem_edit", "rec_edit", "sim"}


def test_the_loss_is_the_weighted_sum_of_its_terms(
    small_config: Config, realistic: RealisticShapes
) -> None:
    terms = Trainer(small_config, realistic).train_step()
    expected = (
        0.3 * (terms["sem"] + terms["sem_edit"])
        + 30 * (terms["rec"] + terms["rec_edit"])
        + 50 * terms["sim"]
    )
    assert terms["loss"].item() == pytest.approx(expected.item(), rel=1e-5)


def test_terms_can_be_left_out(small_config: Config, realistic: RealisticShapes) -> None:
    plain = Trainer(replace(small_config, editing=False, weights=Weights(gamma=0.0)), realistic)
    assert set(plain.train_step()) == {"loss", "sem", "rec"}
    alone = Trainer(replace(small_config, editing=True), None)
    assert set(alone.train_step()) == {"loss", "sem", "rec", "sem_edit", "rec_edit"}


@pytest.mark.parametrize("law", ["set", "cycle"])
def test_other_laws_of_edits_train_and_resume(
    small_config: Config, tmp_path: Path, law: str
) -> None:
    config = replace(small_config, edit=law)
    whole, first, second = (Trainer(config, None) for _ in range(3))
    expected = [whole.train_step() for _ in range(4)]
    assert set(expected[0]) == {"loss", "sem", "rec", "sem_edit", "rec_edit"}
    plain = Trainer(small_config, None).train_step()
    assert plain["sem"] == expected[0]["sem"]
    assert plain["sem_edit"] != expected[0]["sem_edit"]
    steps = [first.train_step() for _ in range(2)]
    second.restore(first.state())
    assert [*steps, *(second.train_step() for _ in range(2))] == expected


def test_clouds_of_predictions_leave_the_running_statistics_alone(small_config: Config) -> None:
    trainer = Trainer(small_config, None)
    trainer.encoder.train()
    clouds = trainer.synthetic.batch(8, 64).points
    before = {name: value.clone() for name, value in trainer.encoder.named_buffers()}
    trainer._encode_again(clouds)
    for name, value in trainer.encoder.named_buffers():
        if "num_batches" not in name:
            assert torch.equal(value, before[name]), name
    trainer._encode(clouds)
    means = [name for name in before if "running_mean" in name]
    assert all(
        not torch.equal(dict(trainer.encoder.named_buffers())[name], before[name]) for name in means
    )


def test_the_similarity_loss_sees_as_many_points_as_are_set(
    small_config: Config, realistic: RealisticShapes, monkeypatch: pytest.MonkeyPatch
) -> None:
    trainer = Trainer(replace(small_config, similarity_points=20), realistic)
    seen = []
    similarity = trainer.losses.similarity
    monkeypatch.setattr(
        trainer.losses, "similarity", lambda *a: (seen.append(a[2]), similarity(*a))[1]
    )
    trainer.train_step()
    assert seen == [20]


def test_the_learning_rate_is_kept_or_decays_along_a_cosine(small_config: Config) -> None:
    def rates(config: Config) -> list[float]:
        trainer = Trainer(config, None)
        found = []
        for step in (0, 30, 60):
            trainer.step = step
            trainer._set_learning_rate()
            found.append(trainer.optimizer.param_groups[0]["lr"])
        return found

    assert rates(small_config) == [3e-3] * 3
    expected = [3e-3 * (0.5 * (1 + math.cos(math.pi * s / 60)) + 1e-3) for s in (0, 30, 60)]
    assert rates(replace(small_config, cosine=True)) == pytest.approx(expected)


def test_clouds_vary_in_size_and_end_at_the_served_one(small_config: Config) -> None:
    config = replace(small_config, points=(20, 60), final_points=77, final_share=0.2)
    trainer = Trainer(config, None)
    sizes = [trainer._points() for _ in range(300)]
    assert (min(sizes), max(sizes)) == (20, 60)
    assert np.median(sizes) == pytest.approx(math.sqrt(20 * 60), abs=4)
    trainer.step = 47
    assert trainer._points() <= 60
    trainer.step = 48
    assert trainer._points() == 77


def test_a_run_logs_validates_and_leaves_a_checkpoint(small_config: Config, tmp_path: Path) -> None:
    trainer = Trainer(replace(small_config, steps=8), None)
    stopped = train.run(trainer, tmp_path, every=3, until=5)
    assert trainer.step == 5
    state = torch.load(tmp_path / "checkpoint.pt", weights_only=True)
    assert (state["step"], state["config"]["steps"]) == (5, 8)
    resumed = Trainer(replace(small_config, steps=8), None)
    resumed.restore(state)
    result = train.run(resumed, tmp_path, every=3)
    lines = [json.loads(line) for line in (tmp_path / "log.jsonl").read_text().splitlines()]
    assert [line["step"] for line in lines] == [3, 5, 6, 8]
    assert lines[1]["within"] == list(stopped.within)
    assert lines[3]["within"] == list(result.within)
    assert {"loss", "sem", "rec", "seconds", "edited"} <= set(lines[0])
    kept = {"checkpoint.pt", "log.jsonl", "stand.yaml"}
    assert {path.name for path in tmp_path.iterdir()} == kept
    assert torch.load(tmp_path / "checkpoint.pt", weights_only=True)["step"] == 8


def test_a_finished_run_is_only_measured(small_config: Config, tmp_path: Path) -> None:
    trainer = Trainer(replace(small_config, steps=1), None)
    trainer.step = 1
    result = train.run(trainer, tmp_path)
    assert trainer.step == 1
    assert len(result.within) == 3


def test_the_command_line_trains_and_resumes(
    stand_file: Path, meshes: Path, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    config = tmp_path / "small.yaml"
    config.write_text(
        f"template: {stand_file}\nsteps: 2\nbatch: 4\npoints: [32, 32]\nfinal_points: 64\n"
        "shared: [8]\nhead: [8]\n",
        "utf-8",
    )
    monkeypatch.chdir(tmp_path)
    arguments = ["train", str(config), "--realistic", str(meshes), "--device", "cpu", "--seed", "9"]
    monkeypatch.setattr("sys.argv", arguments)
    train.main()
    assert "8 real shapes to train on, 0 unreadable" in capsys.readouterr().out
    state = torch.load(tmp_path / "runs" / "small" / "checkpoint.pt", weights_only=True)
    assert (state["step"], state["config"]["seed"]) == (2, 9)
    monkeypatch.setattr("sys.argv", [*arguments, "--resume", "--steps", "3"])
    train.main()
    state = torch.load(tmp_path / "runs" / "small" / "checkpoint.pt", weights_only=True)
    assert state["step"] == 3


def test_a_new_run_forgets_the_log_of_a_former_one(small_config: Config, tmp_path: Path) -> None:
    (tmp_path / "log.jsonl").write_text('{"step": 99}\n', "utf-8")
    train.run(Trainer(replace(small_config, steps=1), None), tmp_path)
    lines = (tmp_path / "log.jsonl").read_text("utf-8").splitlines()
    assert [json.loads(line)["step"] for line in lines] == [1]


def test_the_command_line_takes_a_template(
    stand_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    own = tmp_path / "mine.yaml"
    own.write_text(stand_file.read_text("utf-8"), "utf-8")
    arguments = ["train", "mine.yaml", "--quick", "--device", "cpu", "--steps"]
    monkeypatch.setattr("sys.argv", [*arguments, "2"])
    train.main()
    state = torch.load(tmp_path / "runs" / "mine" / "checkpoint.pt", weights_only=True)
    assert state["step"] == 2
    assert state["config"]["template"] == "mine.yaml"
    assert (tmp_path / "runs" / "mine" / "mine.yaml").read_bytes() == own.read_bytes()
    said = capsys.readouterr()
    assert "step 1: vertices within .01/.02/.03: " in said.out
    assert "2/2" in said.err
    monkeypatch.setattr("sys.argv", [*arguments, "3", "--resume"])
    train.main()
    # A template that has changed meanwhile is another category.
    own.write_text(stand_file.read_text("utf-8").replace("0.05, 0.2", "0.05, 0.3"), "utf-8")
    monkeypatch.setattr("sys.argv", [*arguments, "4", "--resume"])
    with pytest.raises(ValueError, match=r"mine\.yaml has changed since the run"):
        train.main()


def test_what_can_not_be_trained_ends_the_command_with_a_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = tmp_path / "bad.yaml"
    bad.write_text("name: bad\nparts: {}\n", "utf-8")
    monkeypatch.setattr("sys.argv", ["train", str(bad)])
    with pytest.raises(SystemExit) as end:
        train.main()
    assert end.value.code == 1
    assert "'parameters' is missing" in capsys.readouterr().err
