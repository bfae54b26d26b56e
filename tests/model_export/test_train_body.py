from __future__ import annotations

import json
from pathlib import Path

import pytest
import torch
import trimesh

from model_export.bodies import Garments, SyntheticBodies
from model_export.bodyconfig import BodyConfig
from model_export.realistic import RealisticShapes
from model_export.runs import load_checkpoint
from model_export.train_body import (
    BodyTrainer,
    ordered,
    run,
)
from service.encode.bodyoutputs import ANCHORS
from service.template.skinned import SkinnedTemplate

SMALL = BodyConfig(
    steps=8, batch=4, real_share=0.25, points=160, warmup=2, width=16, depth=1, neighbours=6,
    precision="fp32",
)  # fmt: skip


@pytest.fixture
def real(human: SkinnedTemplate, tmp_path: Path) -> RealisticShapes:
    folder = tmp_path / "real"
    folder.mkdir()
    for index in range(6):
        vertices = human.rest * (1.0 + 0.02 * index)
        trimesh.Trimesh(vertices, human.faces, process=False).export(folder / f"{index}.ply")
    return RealisticShapes(folder, tmp_path / "cache", 0)


def test_a_step_trains_on_both_kinds(human: SkinnedTemplate, real: RealisticShapes) -> None:
    trainer = BodyTrainer(SMALL, human, real)
    before = [p.clone() for p in trainer.encoder.parameters()]
    terms = trainer.train_step()
    assert {"joint", "sem", "rec", "sim", "loss"} <= set(terms)
    assert "sim" not in BodyTrainer(SMALL, human, None).train_step()
    moved = [
        not torch.equal(a, b) for a, b in zip(before, trainer.encoder.parameters(), strict=True)
    ]
    assert all(moved)


def test_training_lessens_the_loss(human: SkinnedTemplate) -> None:
    trainer = BodyTrainer(BodyConfig(**(vars(SMALL) | {"steps": 60, "batch": 8})), human, None)
    losses = [trainer.train_step()["loss"].item() for _ in range(60)]
    assert sum(losses[-10:]) < 0.85 * sum(losses[:10])


def test_a_resumed_run_is_the_same(
    human: SkinnedTemplate, real: RealisticShapes, tmp_path: Path
) -> None:
    whole = BodyTrainer(SMALL, human, real)
    for _ in range(6):
        whole.train_step()
    first = BodyTrainer(SMALL, human, real)
    run(first, tmp_path / "run", every=3, until=3)
    second = BodyTrainer(SMALL, human, real)
    second.restore(load_checkpoint(tmp_path / "run" / "checkpoint.pt"))
    for _ in range(3):
        second.train_step()
    for a, b in zip(whole.encoder.parameters(), second.encoder.parameters(), strict=True):
        assert torch.equal(a, b)


def test_a_run_leaves_a_log(human: SkinnedTemplate, tmp_path: Path) -> None:
    run(BodyTrainer(SMALL, human, None), tmp_path, every=4)
    lines = [json.loads(line) for line in (tmp_path / "log.jsonl").read_text().splitlines()]
    assert [line["step"] for line in lines] == [4, 8]
    assert all(line["votes"] > 0.0 for line in lines)


def test_anchors_come_first_with_all_that_is_theirs(human: SkinnedTemplate) -> None:
    batch = SyntheticBodies(human, Garments.none(), 0).batch(2, 200)
    sorted_batch = ordered(batch)
    gaps = torch.cdist(sorted_batch.points[:, :ANCHORS], sorted_batch.points)
    assert (
        gaps.amin(dim=1).mean()
        < torch.cdist(batch.points[:, :ANCHORS], batch.points).amin(dim=1).mean()
    )
    for index in range(2):
        where = torch.cdist(sorted_batch.points[index], batch.points[index]).argmin(dim=1)
        assert torch.equal(sorted_batch.normals[index], batch.normals[index][where])
