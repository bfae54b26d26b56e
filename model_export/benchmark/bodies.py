"""How well bodies are found, and how well they move: H of the benchmark."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from model_export.benchmark.characters import Character
from model_export.bodytruth import KnownBody, body_errors, character_bodies, mpjpe, without_offsets
from model_export.realistic import RealisticShape
from model_export.rivals.inpainting import inpainted
from model_export.skin_fit import served_fit
from model_export.skin_report import STATURE, Score, fitted, score_all
from service.deform import bodypaper, skinbinding
from service.deform.skinbinding import SkinBinding, sparse_rows
from service.encode.bodyestimate import estimate_body
from service.encode.bodymodel import BodyModel
from service.mesh.formats import read_mesh
from service.mesh.surface import sample_surface
from service.template.anatomy import PARENTS
from service.template.skinned import Body, SkinnedTemplate
from service.template.skinning import pose_joints, rotation_matrices

Array = NDArray[np.float64]
Faces = NDArray[np.int64]

ROWS = {"skin": "blend (skinning)", "nearest": "nearest vertex's weights",
        "inpainted": "inpainted weights", "paper": "paper, k = 32"}  # fmt: skip
"""The rules as the tables call them."""


@dataclass(frozen=True)
class Posed:
    """A body whose joints and their turns are known.

    Attributes:
        known: the joints.
        turned: ``[24, 3, 3]`` rotations in space, from the T-pose.
    """

    known: KnownBody
    turned: Array


def synthetic(model: BodyModel, own: Sequence[Character]) -> Iterator[Posed]:
    """Of characters that were made."""
    for character in own:
        rig = character.rig
        rng = np.random.default_rng(0)
        samples = sample_surface(rig.vertices, rig.faces, model.points, rng)
        name, joints = character.name, rig.positions
        known = KnownBody(name, "synthetic", samples, joints, character.stature)
        yield Posed(known, character.turned)


def real(model: BodyModel, shapes: Sequence[RealisticShape]) -> Iterator[Posed]:
    """Of characters whose manifest has joints and a pose."""
    for shape, known in zip(shapes, character_bodies(shapes, model.points), strict=True):
        vectors = np.array(shape.info["pose_smpl_axis_angle"], np.float64)
        rotations = rotation_matrices(vectors)
        yield Posed(known, pose_joints(rotations, model.template.joints, PARENTS)[0])


def joint_table(model: BodyModel, bodies: Sequence[Posed]) -> str:
    """MPJPE and geodesic errors, by source."""
    lines = [
        "| bodies | | MPJPE, mm: encoder alone | refined | without each joint's mean offset "
        "| turns, degrees: encoder alone, mean / median | refined, mean / median | facing right |",
        "|---" * 8 + "|",
    ]
    for source in dict.fromkeys(body.known.source for body in bodies):
        own = [body for body in bodies if body.known.source == source]
        errors = body_errors(model, [body.known for body in own])
        turns = [
            np.concatenate([turn_errors(model, body, refined) for body in own])
            for refined in (False, True)
        ]
        facing = sum(error.facing < 30.0 for error in errors)
        cells = [
            source,
            str(len(own)),
            f"{mpjpe([error.encoder for error in errors])}",
            f"{mpjpe([error.refined for error in errors])}",
            f"{mpjpe(without_offsets(errors))}",
            *(f"{turn.mean():.1f} / {np.median(turn):.1f}" for turn in turns),
            f"{facing} of {len(own)}",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def turn_errors(model: BodyModel, body: Posed, refined: bool) -> Array:
    """``[24]`` degrees between each joint's rotation in space and the true one."""
    found = estimate_body(model, body.known.samples, refined=refined, metre=1.0).body
    turned = pose_joints(found.rotations, model.template.joints, PARENTS)[0]
    between = Rotation.from_matrix(turned.swapaxes(1, 2) @ body.turned)
    degrees: Array = np.degrees(between.magnitude())
    return degrees


def moved_scores(model: BodyModel, own: Sequence[Character]) -> list[Score]:
    """Edits of single joints against the characters' own rigs; see `skin_report`."""
    fit = served_fit(model)
    cases = [
        fitted((c.name, "its own"), c.rig, model.template, fit, c.stature / STATURE) for c in own
    ]
    return score_all(cases, model.template)


def moved_table(scores: Sequence[Score]) -> str:
    """A line for each rule."""
    lines = [
        "| rule | V2V about the fitted joint, mm | about the true joint, mm | torn edges, % |",
        "|---" * 4 + "|",
    ]
    for rule, name in ROWS.items():
        own = [score for score in scores if score.rule == rule]
        figures = [np.mean([getattr(s, key) for s in own]) for key in ("v2v", "v2v_rig", "torn")]
        lines.append("| {} | {:.2f} | {:.2f} | {:.3f} |".format(name, *figures))
    return "\n".join(lines)


def changes(
    x: Array, faces: Faces, template: SkinnedTemplate, before: Body, after: Body
) -> dict[str, Array]:
    """``[V, 3]`` the mesh that each rule makes when the body fitted to it becomes another."""
    nearest = template.weights[cKDTree(template.decode(before)).query(x)[1]]
    skin = skinbinding.bind(x, faces, template, before)

    def skinned(weights: Array) -> Array:
        influences = csr_array(sparse_rows(weights))
        return SkinBinding(template, x, influences, skin.shapedirs).move(before, after)

    paper = bodypaper.bind(x, template, before)
    return {
        "skin": skin.move(before, after),
        "nearest": skinned(nearest),
        "inpainted": skinned(inpainted(x, faces, template, before)),
        "paper": x + paper.carry(before, after)[0],
    }


def pose_errors(model: BodyModel, shapes: Sequence[RealisticShape]) -> dict[str, list[float]]:
    """Millimetres from a character, brought to the pose that was fitted to another file of it, to
    that file's own vertices: of each rule, and of the character left as it was.

    Characters count that come in several poses with one order of vertices.
    """
    groups: dict[tuple[str, object], list[RealisticShape]] = {}
    for shape in shapes:
        key = str(shape.info.get("character", shape.name)), shape.info.get("vertices")
        groups.setdefault(key, []).append(shape)
    fit, errors = served_fit(model), dict[str, list[float]]()
    nowhere = np.full((len(PARENTS), 3), np.nan)
    for group in (group for group in groups.values() if len(group) > 1):
        meshes = [read_mesh(shape.path.read_bytes(), shape.path.name) for shape in group]
        if any(not np.array_equal(mesh.faces, meshes[0].faces) for mesh in meshes):
            continue
        fits = [fit(mesh.vertices, mesh.faces, nowhere) for mesh in meshes]
        unit = max(float(shape.info.get("height_m", 1.7)) for shape in group) / STATURE  # type: ignore[arg-type]
        for one, other in permutations(range(len(group)), 2):
            x, y = meshes[one].vertices, meshes[other].vertices
            after = brought(model.template, fits[one], fits[other])
            made = changes(x, meshes[one].faces, model.template, fits[one], after)
            for rule, result in {"as it was": x, **made}.items():
                off = float(np.linalg.norm(result - y, axis=1).mean()) / unit
                errors.setdefault(rule, []).append(off)
    return errors


def brought(template: SkinnedTemplate, body: Body, other: Body) -> Body:
    """A body in another's pose and place, its shape and size its own."""
    root = template.posed_joints(other)[0]
    moved = replace(body, rotations=other.rotations)
    return replace(moved, translation=moved.translation + root - template.posed_joints(moved)[0])


def pose_table(errors: Mapping[str, Sequence[float]]) -> str:
    """A line for each rule."""
    lines = ["| rule | pairs | V2V, mean, mm | median |", "|---" * 4 + "|"]
    for rule, own in errors.items():
        name = ROWS.get(rule, rule)
        lines.append(f"| {name} | {len(own)} | {np.mean(own):.1f} | {np.median(own):.1f} |")
    return "\n".join(lines)
