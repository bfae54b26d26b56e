from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from model_export import ablation
from model_export.ablation import GROUPS, Judge, plain, planned, read_lines, rows, run_row
from model_export.config import Config, load_config
from model_export.realistic import RealisticShapes
from model_export.train import Trainer
from model_export.validation import held_out_clouds, validation_set


@pytest.fixture
def tiny(small_config: Config) -> Config:
    """A run of two steps."""
    return replace(small_config, steps=2, batch=4, points=(32, 32), final_share=0.0)


@pytest.fixture
def realistic(meshes: Path, tmp_path: Path) -> RealisticShapes:
    return RealisticShapes(meshes, tmp_path / "cache", seed=5)


def test_the_papers_rows_differ_in_losses_and_branch() -> None:
    base = load_config("ablation-chair")
    found = [row for row in rows(base) if row.group == "losses"]
    assert [row.name for row in found] == [
        "L_sem", "L_rec", "L_sem + L_rec, no editing branch", "L_sem + L_rec"
    ]  # fmt: skip
    weights = [(row.config.weights.alpha, row.config.weights.beta) for row in found]
    assert weights == [(0.3, 0.0), (0.0, 30.0), (0.3, 30.0), (0.3, 30.0)]
    assert [row.config.editing for row in found] == [True, True, False, True]
    assert all(row.config.weights.gamma == 50.0 for row in found)
    assert found[3].config == base


def test_other_rows_differ_in_one_thing_from_the_whole_model() -> None:
    base = load_config("ablation-chair")
    others = {(row.group, row.name): row.config for row in rows(base) if row.group != "losses"}
    without = others["real", "L_sem + L_rec"]
    assert (without.weights.gamma, without.real_share) == (0.0, 0.0)
    restored = replace(without, weights=base.weights, real_share=base.real_share)
    assert restored == base
    assert others["edits", "set"] == replace(base, edit="set")
    assert others["edits", "cycle"] == replace(base, edit="cycle")
    assert others["norms", "l1"] == replace(base, norm="l1")
    assert others["longer", "3 times the steps"] == replace(base, steps=3 * base.steps)
    configs = [row.config for row in rows(base)]
    assert all(configs.count(config) == 1 for config in configs)


def test_what_matters_most_runs_first(tiny: Config) -> None:
    found = list(planned(tiny, GROUPS, 3))
    assert len(found) == 3 * (4 + 4 + 2 + 1 + 1)
    assert [row.config.seed for row in found[:12]] == [0] * 4 + [1] * 4 + [2] * 4
    assert {row.group for row in found[:12]} == {"losses"}
    assert [(row.group, row.name) for row in found[12:15]] == [("real", "L_sem + L_rec")] * 3
    assert [row.name for row in planned(tiny, ["norms"], 2)] == ["l1", "l1"]


def test_a_run_without_real_shapes_sees_none(tiny: Config, realistic: RealisticShapes) -> None:
    (row,) = (r for r in rows(tiny) if (r.group, r.name) == ("losses_without_real", "L_sem"))
    trainer = Trainer(row.config, realistic)
    drawn = trainer._next()
    assert (len(drawn.batch.points), len(drawn.real)) == (4, 0)
    assert set(trainer.train_step()) == {"loss", "sem", "rec", "sem_edit", "rec_edit"}


def test_a_run_goes_on_from_its_checkpoint_and_from_no_other(
    tiny: Config, realistic: RealisticShapes, meshes: Path, tmp_path: Path
) -> None:
    row = rows(tiny)[3]
    trainer = Trainer(tiny, realistic)
    judge = Judge(validation_set(trainer.template, 50), held_out_clouds(meshes, 64))
    whole = run_row(row, realistic, judge, tmp_path / "whole")
    assert (whole["group"], whole["row"], whole["seed"]) == ("losses", "L_sem + L_rec", 5)
    assert whole["config"] == plain(tiny)
    assert len(whole["within_percent"]) == len(whole["edited_within_percent"]) == 3
    assert 0.0 < whole["real_distance_median"] < 0.5
    # Half a run's checkpoint, and what another configuration left.
    folder = tmp_path / "stopped"
    ablation.run(trainer, folder, every=1, until=1)
    went_on = run_row(row, realistic, judge, folder)
    assert went_on | {"minutes": 0} == whole | {"minutes": 0}
    other = replace(row, config=replace(tiny, seed=6))
    anew = run_row(other, realistic, judge, folder)
    assert anew["seed"] == 6
    assert torch.load(folder / "checkpoint.pt", weights_only=True)["config"]["seed"] == 6


def test_the_command_line_appends_what_is_missing(
    stand_file: Path, meshes: Path, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    config = tmp_path / "tiny.yaml"
    config.write_text(
        f"template: {stand_file}\nsteps: 1\nbatch: 4\npoints: [32, 32]\nfinal_points: 64\n"
        "shared: [8]\nhead: [8]\n",
        "utf-8",
    )
    monkeypatch.chdir(tmp_path)
    out = tmp_path / "results" / "ablation.jsonl"
    arguments = ["ablation", str(config), "--realistic", str(meshes), "--seeds", "1", "--count",
                 "50", "--out", str(out), "--groups"]  # fmt: skip
    monkeypatch.setattr("sys.argv", [*arguments, "edits"])
    ablation.main()
    first = out.read_text("utf-8")
    assert [line["row"] for line in read_lines(out)] == ["set", "cycle"]
    monkeypatch.setattr("sys.argv", [*arguments, "edits", "norms"])
    ablation.main()
    text = out.read_text("utf-8")
    assert text.startswith(first)
    lines = read_lines(out)
    assert [line["row"] for line in lines] == ["set", "cycle", "l1"]
    assert lines[2]["config"]["norm"] == "l1"
    assert lines[2]["place"] == "CPU, threads: 1"
    assert json.loads(json.dumps(lines)) == lines
    assert "norms l1 0" in capsys.readouterr().out
    assert (tmp_path / "runs" / "ablation" / "norms-l1-0" / "checkpoint.pt").is_file()


def test_no_file_holds_no_results(tmp_path: Path) -> None:
    assert read_lines(tmp_path / "none.jsonl") == []
