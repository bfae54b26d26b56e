"""Settings of a training run of the body's encoder."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import yaml

from model_export.bodies import Garments
from model_export.bodylosses import BodyWeights


@dataclass(frozen=True)
class BodyConfig:
    """Everything that decides a run; the defaults are the shipped model's.

    Attributes:
        steps: optimiser steps.
        batch: bodies a step.
        real_share: share of the batch that is real.
        points: a cloud.
        learning_rate: the largest, of AdamW; it rises linearly, and falls along a cosine.
        warmup: steps that it rises.
        decay: of the weights.
        precision: ``fp32``, or ``bf16`` arithmetic in the network.
        width, depth, neighbours: of the encoder.
        weights: of the losses.
        garments: of synthetic bodies.
        seed: of everything random.
    """

    steps: int = 5600
    batch: int = 256
    real_share: float = 0.125
    points: int = 1024
    learning_rate: float = 1.5e-3
    warmup: int = 1000
    decay: float = 0.01
    precision: str = "bf16"
    width: int = 128
    depth: int = 4
    neighbours: int = 24
    weights: BodyWeights = field(default_factory=BodyWeights)
    garments: Garments = field(default_factory=Garments)
    seed: int = 0


def load_body_config(path: Path | None) -> BodyConfig:
    """A configuration from a YAML file; None is the shipped model's.

    Raises:
        ValueError: for an entry that no setting is named after.
    """
    if path is None:
        return BodyConfig()
    entries = yaml.safe_load(path.read_text("utf-8")) or {}
    unknown = set(entries) - {field.name for field in fields(BodyConfig)}
    if unknown:
        raise ValueError(f"{path}: no setting is named {sorted(unknown)[0]!r}")
    return body_config(entries)


def body_config(entries: dict[str, Any]) -> BodyConfig:
    """A configuration from plain values, as files and checkpoints hold them."""
    entries = dict(entries)
    for name, kind in (("weights", BodyWeights), ("garments", Garments)):
        if isinstance(entries.get(name), dict):
            entries[name] = kind(**entries[name])
    return BodyConfig(**entries)
