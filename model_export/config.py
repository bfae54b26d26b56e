"""One screen of training configuration, read from `configs/<name>.yaml`."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from importlib import resources
from pathlib import Path
from typing import Any

import yaml

from model_export.losses import EDITS, NORMS, Weights
from model_export.synthetic import Augmentation
from service.encode.model import SHIPPED as SHIPPED
from service.template.loader import load_template


@dataclass(frozen=True)
class Config:
    """Everything that decides a training run; the defaults are the paper's.

    Attributes:
        template: a built-in category or a template file.
        steps: optimiser steps.
        batch: shapes a step.
        real_share: share of the batch that is real; the paper's half.
        points: fewest and most points a cloud; each step draws a number in between.
        final_points: points a cloud in the last `final_share` of the steps: the served size.
        final_share: that share.
        learning_rate: of Adam.
        cosine: decay the learning rate to nothing along a cosine.
        precision: ``fp32``, or ``bf16`` arithmetic in the shared layers.
        shared: widths of the encoder before the pool.
        head: hidden widths after it; None is the paper's.
        keypoints: how many the encoder attends to; None is the paper's, a maximum over features.
        editing: use the editing branch.
        edit: what it compares, of `losses.EDITS`.
        norm: of the semantic loss, of `losses.NORMS`.
        similarity_points: most samples of a real cloud, and those of a template, that L_sim sees.
        weights: of the losses.
        augmentation: of synthetic clouds.
        log_share: share of synthetic shapes drawn evenly in the logarithm.
        seed: of everything random.
    """

    template: str = "paper_chair"
    steps: int = 40000
    batch: int = 16
    real_share: float = 0.5
    points: tuple[int, int] = (512, 512)
    final_points: int = 2840
    final_share: float = 0.0
    learning_rate: float = 1e-3
    cosine: bool = False
    precision: str = "fp32"
    shared: tuple[int, ...] = (64, 128, 128, 256)
    head: tuple[int, ...] | None = None
    keypoints: int | None = None
    editing: bool = True
    edit: str = "multiply"
    norm: str = "l2"
    similarity_points: int = 768
    weights: Weights = field(default_factory=Weights)
    augmentation: Augmentation = field(default_factory=Augmentation)
    log_share: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for name, choices in (("edit", EDITS), ("norm", NORMS)):
            if getattr(self, name) not in choices:
                raise ValueError(f"{name} is one of {', '.join(choices)}, "
                    f"not {getattr(self, name)!r}")  # fmt: skip


FULL, QUICK = "chair", "quick"
"""Settings for a category of one's own: those of the shipped chair, or minutes instead of hours."""


def config_of(source: str, quick: bool = False, **overrides: Any) -> Config:
    """What to train: a configuration (see `load_config`), or a template file with shipped settings.

    Args:
        source: a built-in configuration's name, or the path of a configuration or a template.
        quick: minutes on a CPU instead of hours; for template files.
        overrides: settings that win where they are not None.

    Raises:
        ValueError: as `load_config`; TemplateError for a template that can't be compiled.
    """
    if is_template(source):
        served = load_template(source).points
        settings = QUICK if quick else FULL
        return load_config(settings, template=source, final_points=served, **overrides)
    if quick:
        raise ValueError(f"{source} is a configuration with its own settings; --quick is for "
            "template files")  # fmt: skip
    return load_config(source, **overrides)


def is_template(source: str) -> bool:
    """Whether a path is that of a template file: one that lists parts."""
    path = Path(source)
    if path.suffix not in (".yaml", ".yml") or not path.is_file():
        return False
    entries = yaml.safe_load(path.read_text("utf-8"))
    return isinstance(entries, dict) and "parts" in entries


def load_config(source: str, **overrides: Any) -> Config:
    """A configuration by built-in name or path; `overrides` that are not None win.

    Raises:
        ValueError: for a missing file or an entry that no field is named after.
    """
    path = Path(source)
    if path.suffix in (".yaml", ".yml"):
        text = path.read_text("utf-8")
    else:
        file = resources.files("model_export.configs") / f"{source}.yaml"
        if not file.is_file():
            raise ValueError(f"there is no configuration named {source!r}")
        text = file.read_text("utf-8")
    entries = (yaml.safe_load(text) or {}) | {k: v for k, v in overrides.items() if v is not None}
    unknown = set(entries) - {entry.name for entry in fields(Config)}
    if unknown:
        raise ValueError(f"{source}: no setting is named {sorted(unknown)[0]!r}")
    return from_plain(entries)


def from_plain(entries: dict[str, Any]) -> Config:
    """A configuration from plain values, as files and checkpoints hold them."""
    entries = dict(entries)
    nested = {"weights": Weights, "augmentation": Augmentation}
    for name, kind in nested.items():
        if isinstance(entries.get(name), dict):
            entries[name] = kind(**entries[name])
    for name in ("shared", "head", "points"):
        if isinstance(entries.get(name), list):
            entries[name] = tuple(entries[name])
    return Config(**entries)
