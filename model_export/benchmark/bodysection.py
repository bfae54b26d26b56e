"""The page's section on bodies."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from model_export.benchmark.bodies import (
    joint_table,
    moved_scores,
    moved_table,
    pose_errors,
    pose_table,
    real,
    synthetic,
)
from model_export.benchmark.characters import characters
from model_export.benchmark.unlikebodies import sound_table, unlike
from model_export.realistic import find_shapes
from service.encode.bodymodel import BodyModel
from service.encode.model import Model

ABOUT = """Synthetic bodies have a random pose, shape and clothes, every other one 2500 vertices;
their rig is the template's, their fit the service's own, from the surface alone.  Millimetres are
at a stature of 1.7 m.  Turns are of joints in space."""
MOVED = """Single joints turned by 30 and 60 degrees either way, against the body's own rig: mean
distance of vertices (V2V).  About the true joint, weights alone differ."""
POSED = """Characters that come in several poses with one order of vertices, each brought to the
pose that was fitted to another: V2V to that file's own vertices, errors of both fits included."""
UNLIKE = """What the paper shows of bodies unlike its training's, single joints turned by 30 degrees
either way: no truth is known.  Crossings are new pairs of faces against the input; skin that folds
at a joint and clothes that slide on it count too."""


def body_section(model: Model, count: int, folder: Path | None, say: Callable[[str], None]) -> str:
    """So many synthetic bodies, and the held-out characters of a folder.

    Args:
        model: the category.
        count: synthetic bodies.
        folder: of characters, with a manifest that has their joints.
        say: told what is done next.
    """
    assert isinstance(model, BodyModel)
    own, shapes = characters(model.template, count), find_shapes(folder) if folder else []
    held_out = [s for s in shapes if s.held_out and "joints_smpl24" in s.info]
    say("bodies: joints")
    parts = [ABOUT, joint_table(model, [*synthetic(model, own), *real(model, held_out)])]
    say("bodies: single joints")
    parts += [MOVED, moved_table(moved_scores(model, own))]
    say("bodies: other poses")
    errors = pose_errors(model, shapes)
    if errors:
        parts += [POSED, pose_table(errors)]
    cases = unlike(held_out)
    if cases:
        say("bodies: unlike ones")
        parts += [UNLIKE, sound_table(model, cases)]
    return "\n\n".join(parts)
