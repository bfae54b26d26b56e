"""The paper's Table 2: what each loss and the editing branch bring.

``python -m model_export.ablation --realistic DIR --out runs/ablation.json``

Each row is one training run with the configuration's settings; export records the table in the
model card (``--ablation``).
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

import torch

from model_export.config import Config, load_config
from model_export.losses import Weights
from model_export.realistic import RealisticShapes
from model_export.train import Trainer, run
from model_export.validation import validate, validation_set

PAPER = {
    "L_sem": [35.2, 72.3, 87.2],
    "L_rec": [11.9, 47.9, 77.6],
    "L_sem + L_rec, no editing branch": [11.5, 55.0, 83.6],
    "L_sem + L_rec": [40.3, 82.2, 95.4],
}


def rows(config: Config) -> dict[str, Config]:
    """The table's runs."""
    alpha, beta, gamma = config.weights.alpha, config.weights.beta, config.weights.gamma
    return {
        "L_sem": replace(config, weights=Weights(alpha, 0.0, gamma)),
        "L_rec": replace(config, weights=Weights(0.0, beta, gamma)),
        "L_sem + L_rec, no editing branch": replace(config, editing=False),
        "L_sem + L_rec": config,
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.ablation")
    parser.add_argument("config", nargs="?", default="ablation-chair", help="built-in name or file")
    parser.add_argument("--realistic", type=Path, help="folder of unlabelled real meshes")
    parser.add_argument("--cache", type=Path, default=Path("cache"), help="for sampled clouds")
    parser.add_argument("--steps", type=int, help="of each run, instead of the configuration's")
    parser.add_argument("--count", type=int, default=500, help="synthetic shapes to measure on")
    parser.add_argument("--out", type=Path, default=Path("runs/ablation.json"), help="to write")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    base = load_config(arguments.config, steps=arguments.steps)
    table = {}
    for name, config in rows(base).items():
        realistic = None
        if arguments.realistic:
            realistic = RealisticShapes(arguments.realistic, arguments.cache, config.seed)
        trainer = Trainer(config, realistic)
        run(trainer, arguments.out.parent / "ablation" / name.replace(" ", "-"), config.steps)
        batch = validation_set(trainer.template, arguments.count)
        result = validate(trainer.encoder, trainer.template, batch)
        table[name] = {
            "vertices_within_percent": [round(100 * share, 1) for share in result.within],
            "edited_within_percent": [round(100 * share, 1) for share in result.edited],
            "paper": PAPER[name],
        }
        print(name, json.dumps(table[name]))
    report = {
        "thresholds": [0.01, 0.02, 0.03],
        "shapes": arguments.count,
        "steps": base.steps,
        "batch": base.batch,
        "rows": table,
    }
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps(report, indent=2) + "\n", "utf-8")


if __name__ == "__main__":
    main()
