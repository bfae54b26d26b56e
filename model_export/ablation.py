"""The paper's Table 2: what each loss, the editing branch and real shapes bring.

``python -m model_export.ablation --realistic DIR --out docs/ablation.jsonl`` appends a line for
each run, and skips those that are there already: stopped, it goes on where it was.
``python -m model_export.ablation_report docs/ablation.jsonl`` prints the tables.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from model_export.config import Config, load_config
from model_export.losses import Weights
from model_export.realistic import RealisticShapes
from model_export.runs import load_checkpoint
from model_export.synthetic import Batch
from model_export.train import Trainer, run
from model_export.validation import held_out_clouds, real_distances, validate, validation_set
from service.encode.distance import Cloud

SEM, REC, UNEDITED, BOTH = "L_sem", "L_rec", "L_sem + L_rec, no editing branch", "L_sem + L_rec"
GROUPS = ("losses", "real", "losses_without_real", "edits", "norms", "longer")
"""In the order of the runs: the paper's table, then what real shapes bring to its last row."""

LONGER = 3
"""Times the steps of the others for the run that tells how far from converged they are."""


@dataclass(frozen=True)
class Row:
    """A row of a table: one configuration, run with several seeds."""

    group: str
    name: str
    config: Config


def rows(base: Config) -> list[Row]:
    """All rows; the one of both losses with the editing branch stands in ``losses`` alone."""
    alone = replace(base, real_share=0.0, weights=replace(base.weights, gamma=0.0))
    found = [Row("losses", name, config) for name, config in _losses(base).items()]
    without = [Row("losses_without_real", name, row) for name, row in _losses(alone).items()]
    found += [replace(without.pop(), group="real"), *without]
    found += [Row("edits", law, replace(base, edit=law)) for law in ("set", "cycle")]
    found.append(Row("norms", "l1", replace(base, norm="l1")))
    return [
        *found,
        Row("longer", f"{LONGER} times the steps", replace(base, steps=LONGER * base.steps)),
    ]


def _losses(base: Config) -> dict[str, Config]:
    """The paper's rows, in its order."""
    alpha, beta, gamma = base.weights.alpha, base.weights.beta, base.weights.gamma
    return {
        SEM: replace(base, weights=Weights(alpha, 0.0, gamma)),
        REC: replace(base, weights=Weights(0.0, beta, gamma)),
        UNEDITED: replace(base, editing=False),
        BOTH: base,
    }


def planned(base: Config, groups: Sequence[str], seeds: int) -> Iterator[Row]:
    """The runs, group by group; of each group every row with a seed before any with the next."""
    for group in groups:
        for seed in range(seeds):
            for row in rows(base):
                if row.group == group:
                    yield replace(row, config=replace(row.config, seed=seed))


@dataclass(frozen=True)
class Judge:
    """What every run is measured on: ``synthetic`` shapes, and ``real`` ones held out."""

    synthetic: Batch
    real: list[Cloud]

    def measure(self, trainer: Trainer) -> dict[str, Any]:
        """Figures of an encoder alone."""
        result = validate(trainer.encoder, trainer.template, self.synthetic)
        distances = real_distances(trainer.encoder, trainer.template, self.real)
        return {
            "within_percent": [round(100 * share, 2) for share in result.within],
            "edited_within_percent": [round(100 * share, 2) for share in result.edited],
            "real_distance_median": round(float(np.median(distances)), 5),
            "real_distance_mean": round(float(distances.mean()), 5),
        }


def run_row(
    row: Row, realistic: RealisticShapes, judge: Judge, folder: Path, compiled: bool = False
) -> dict[str, Any]:
    """Train a row's run to its end, from its checkpoint where there is one; its line of results."""
    trainer = Trainer(row.config, realistic, compiled=compiled)
    checkpoint = folder / "checkpoint.pt"
    if checkpoint.is_file():
        state = load_checkpoint(checkpoint)
        if state["config"] == asdict(row.config):
            trainer.restore(state)
    run(trainer, folder, every=-(-row.config.steps // 3))
    return {
        "group": row.group,
        "row": row.name,
        "seed": row.config.seed,
        **judge.measure(trainer),
        "minutes": round(trainer.seconds / 60, 2),
        "place": trainer.place,
        "config": plain(row.config),
    }


def plain(config: Config) -> dict[str, Any]:
    """A configuration as JSON has it."""
    return json.loads(json.dumps(asdict(config)))


def read_lines(path: Path) -> list[dict[str, Any]]:
    """The results that are there."""
    if not path.is_file():
        return []
    return [json.loads(line) for line in path.read_text("utf-8").splitlines() if line.strip()]


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.ablation")
    parser.add_argument("config", nargs="?", default="ablation-chair", help="built-in name or file")
    parser.add_argument("--realistic", type=Path, required=True, help="folder of real meshes")
    parser.add_argument("--cache", type=Path, default=Path("cache"), help="for sampled clouds")
    parser.add_argument("--groups", nargs="+", default=GROUPS, choices=GROUPS, help="default: all")
    parser.add_argument("--seeds", type=int, default=3, help="runs of each row")
    parser.add_argument("--steps", type=int, help="of each run, instead of the configuration's")
    parser.add_argument("--count", type=int, default=500, help="synthetic shapes to measure on")
    parser.add_argument("--compile", action="store_true", help="faster; needs a C++ compiler")
    parser.add_argument("--runs", type=Path, default=Path("runs/ablation"), help="for checkpoints")
    parser.add_argument(
        "--out", type=Path, default=Path("runs/ablation.jsonl"), help="to append to"
    )
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    base = load_config(arguments.config, steps=arguments.steps)
    realistic = RealisticShapes(arguments.realistic, arguments.cache, base.seed)
    judge = None
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    for row in planned(base, arguments.groups, arguments.seeds):
        if plain(row.config) in [line["config"] for line in read_lines(arguments.out)]:
            continue
        if judge is None:
            template = Trainer(base, None).template
            held_out = held_out_clouds(arguments.realistic, template.points)
            judge = Judge(validation_set(template, arguments.count), held_out)
        folder = arguments.runs / f"{row.group}-{row.name}-{row.config.seed}".replace(" ", "-")
        line = run_row(row, realistic, judge, folder, arguments.compile)
        with arguments.out.open("a", encoding="utf-8") as out:
            out.write(json.dumps(line) + "\n")
        print(row.group, row.name, row.config.seed, line["edited_within_percent"], flush=True)


if __name__ == "__main__":
    main()
