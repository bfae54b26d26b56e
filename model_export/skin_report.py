"""How edits of bodies compare with the characters' own rigs:
``python -m model_export.skin_report --originals DIR``.

Rigged characters are posed, a body is fitted as the service does, and single joints are turned by
30 and 60 degrees either way, by the rig and by each transfer rule: the service's skinning, the
nearest vertex's weights, inpainted weights (`rivals.inpainting`), and the paper's rule.  Distances
between the results (V2V) are means over the vertices, in millimetres at a stature of 1.7 m.  Turns
are about the fitted joint; about it, moved by the mean offset of the rig's joints in the files of
one convention of names, which takes out that rigs define joints otherwise; and about the rig's own,
which leaves what is due to weights.  An edge is torn when it ends up longer than 4 times what it is
under the rig.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from model_export.config import SHIPPED
from model_export.rigs import POSES, Rig, posed, read_rig
from model_export.rivals.inpainting import inpainted
from model_export.skin_fit import Fit, fit_joints, served_fit
from service.deform import bodypaper, skinbinding
from service.encode.bodymodel import BodyModel
from service.encode.model import load_models
from service.template.anatomy import JOINTS, PARENTS, descendants
from service.template.skinned import Body, SkinnedTemplate
from service.template.skinning import pose_joints

Array = NDArray[np.float64]
Index = NDArray[np.int64]

STATURE = 1700.0
ANGLES = (-60.0, -30.0, 30.0, 60.0)
TORN = 4.0
# Lengths below this, in millimetres at `STATURE`, are as good as none.
SHORT = 0.1

AXES: dict[str, tuple[str, ...]] = {
    "elbow": ("y",), "shoulder": ("z", "x"), "knee": ("x",), "hip": ("x", "z"), "neck": ("x",),
    "head": ("y",), "spine2": ("x", "y"),
}  # fmt: skip
"""The axes, in the T-pose's frame, that joints are turned about."""


@dataclass(frozen=True)
class Score:
    """One edit of one character by one rule.

    Attributes:
        v2v: mean distance to the rig's result, in millimetres at a stature of 1.7 m, by the fit.
        v2v_offset: the same with the fitted joints moved by their mean offsets.
        v2v_rig: the same about the rig's joint.
        torn: percentage of edges that are longer than `TORN` times the rig's, by the fit.
    """

    character: str
    pose: str
    joint: str
    axis: str
    angle: float
    rule: str
    v2v: float
    v2v_offset: float
    v2v_rig: float
    torn: float


@dataclass(frozen=True)
class Case:
    """A character in a pose, and the body that is fitted to it.

    Attributes:
        character, pose: names.
        rig: in the pose.
        body: the fit.
        turned, fitted: ``[24, 3, 3]`` and ``[24, 3]`` its joints.
        unit: length of a millimetre at a stature of 1.7 m.
    """

    character: str
    pose: str
    rig: Rig
    body: Body
    turned: Array
    fitted: Array
    unit: float

    @property
    def offsets(self) -> Array:
        """``[24, 3]`` of the rig's joints from the fitted ones, in the fitted joints' frames and
        in millimetres; not a number where the rig has none."""
        off = (self.rig.positions - self.fitted) / self.unit
        turned: Array = np.einsum("jba,jb->ja", self.turned, off)
        return turned


def prepare(
    character: str, rig: Rig, template: SkinnedTemplate, fit: Fit, poses: Sequence[str]
) -> Iterator[Case]:
    """Fit a body to a character in some of the `POSES`."""
    unit = float(np.ptp(rig.vertices[:, 1])) / STATURE
    for pose in poses:
        yield fitted((character, pose), posed(rig, POSES[pose]), template, fit, unit)


def fitted(
    names: tuple[str, str], rig: Rig, template: SkinnedTemplate, fit: Fit, unit: float
) -> Case:
    """Fit a body to a character in its pose, the names of both being given."""
    body = fit(rig.vertices, rig.faces, rig.positions)
    turned = pose_joints(body.rotations, template.joints, PARENTS)[0]
    return Case(*names, rig, body, turned, template.posed_joints(body), unit)


def mean_offsets(cases: Sequence[Case]) -> dict[str, Array]:
    """``[24, 3]`` means of `Case.offsets` for each convention of names."""
    kinds = dict.fromkeys(case.rig.convention for case in cases)
    return {
        kind: np.mean([case.offsets for case in cases if case.rig.convention == kind], axis=0)
        for kind in kinds
    }


def score_case(case: Case, template: SkinnedTemplate, offsets: Array) -> Iterator[Score]:
    """Scores of all edits of a character in a pose."""
    rig = case.rig
    x = rig.vertices
    rules = bind_all(x, rig.faces, template, case.body)
    edges = np.concatenate([rig.faces[:, [0, 1]], rig.faces[:, [1, 2]]])
    corrected = case.fitted + case.unit * np.einsum("jab,jb->ja", case.turned, offsets)
    for joint, axis, angle in edits():
        index = JOINTS.index(joint)
        if rig.joints[index] < 0:
            continue
        vector = np.radians(angle) * case.turned[index][:, "xyz".index(axis)]
        turn = Rotation.from_rotvec(vector).as_matrix()
        pivots = case.fitted[index], corrected[index], rig.positions[index]
        weight, total = rig.moved_by(joint)
        truth = x + (total - weight[:, None] * pivots[2]) @ (turn - np.eye(3)).T
        usual = edge_lengths(truth, edges)
        for rule, move in rules.items():
            results = [move(index, turn, pivot) for pivot in pivots]
            fit, offset, own = (
                float(np.linalg.norm(y - truth, axis=1).mean()) / case.unit for y in results
            )
            ends = torn(edge_lengths(results[0], edges), usual, SHORT * case.unit)
            yield Score(case.character, case.pose, joint, axis, angle, rule, fit, offset, own, ends)


def bind_all(
    x: Array, faces: Index, template: SkinnedTemplate, body: Body
) -> dict[str, Callable[[int, Array, Array], Array]]:
    """Each rule as what it makes of a joint that turns by ``[3, 3]`` about a pivot ``[3]``.

    For one joint, and all below it, `SkinBinding.move` is this; the pivot need not be the joint.
    """
    carries = descendants()
    surface = template.decode(body)
    nearest = template.weights[cKDTree(surface).query(x)[1]]
    paper = bodypaper.bind(x, template, body)

    def turn(x: Array, weights: Array, joint: int, rotation: Array, pivot: Array) -> Array:
        share = weights[:, carries[joint]].sum(axis=1, keepdims=True)
        return x + share * ((x - pivot) @ (rotation - np.eye(3)).T)

    skin = skinbinding.bind(x, faces, template, body).weights
    painted = inpainted(x, faces, template, body)
    return {
        "skin": lambda *edit: turn(x, skin, *edit),
        "nearest": lambda *edit: turn(x, nearest, *edit),
        "inpainted": lambda *edit: turn(x, painted, *edit),
        "paper": lambda *edit: x + paper.carried(turn(surface, template.weights, *edit) - surface),
    }


def edits() -> Iterator[tuple[str, str, float]]:
    """Joint, axis and angle in degrees of every edit."""
    for joint in JOINTS:
        axes = AXES.get(joint.removeprefix("left_").removeprefix("right_"), ())
        yield from ((joint, axis, angle) for axis in axes for angle in ANGLES)


def edge_lengths(x: Array, edges: Index) -> Array:
    """``[e]`` lengths of ``edges [e, 2]``."""
    lengths: Array = np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1)
    return lengths


def torn(lengths: Array, usual: Array, short: float) -> float:
    """Percentage of edges longer than `TORN` times the usual, which counts as no less than
    ``short``."""
    return 100.0 * float((lengths > TORN * np.maximum(usual, short)).mean())


def table(scores: Sequence[Score], key: Callable[[Score], str]) -> str:
    """Means by a key, in Markdown: the three V2V and edges torn of each rule; then the first rule's
    V2V over the others'."""
    rules = list(dict.fromkeys(score.rule for score in scores))
    head = [f"{rule}: V2V by fit / offset / rig; torn %" for rule in rules]
    head += [f"over {rule}" for rule in rules[1:]]
    lines = ["| | " + " | ".join(head) + " |", "|" + "---|" * (len(head) + 1)]
    for name in dict.fromkeys(key(score) for score in scores):
        means = []
        for rule in rules:
            chosen = [score for score in scores if score.rule == rule and key(score) == name]
            rows = [(s.v2v, s.v2v_offset, s.v2v_rig, s.torn) for s in chosen]
            means.append(np.mean(rows, axis=0))
        cells = ["{:.2f} / {:.2f} / {:.2f}; {:.3f}".format(*mean) for mean in means]
        cells += ["{:.2f} / {:.2f} / {:.2f}".format(*(means[0] / m)[:3]) for m in means[1:]]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> None:
    """Print the tables, and write the scores where asked to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--originals", type=Path, required=True, help="folder of rigged GLBs")
    parser.add_argument("--poses", nargs="+", choices=list(POSES), default=list(POSES))
    parser.add_argument("--body", type=Path, help="another body in SMPL's format")
    parser.add_argument("--told", action="store_true", help="tell the fit where the joints are")
    parser.add_argument("--out", type=Path, help="JSON file of all scores")
    options = parser.parse_args()
    model = load_models(SHIPPED, body=options.body)["human"]
    assert isinstance(model, BodyModel)
    fit = fit_joints(model.template) if options.told else served_fit(model)
    files = sorted(options.originals.glob("*.glb"))
    cases = [
        case
        for file in files
        for case in prepare(
            file.stem, read_rig(file.read_bytes()), model.template, fit, options.poses
        )
    ]
    scores = score_all(cases, model.template)
    keys: list[Callable[[Score], str]] = [
        lambda score: "all",
        lambda score: score.pose,
        lambda score: score.character,
        lambda score: f"{score.joint.removeprefix('left_').removeprefix('right_')} {score.axis}",
    ]
    print("\n\n".join(table(scores, key) for key in keys))
    if options.out:
        options.out.write_text(json.dumps([asdict(score) for score in scores], indent=1))


def score_all(cases: Sequence[Case], template: SkinnedTemplate) -> list[Score]:
    """Scores of all edits."""
    offsets = mean_offsets(cases)
    return [
        score
        for case in cases
        for score in score_case(case, template, offsets[case.rig.convention])
    ]


if __name__ == "__main__":
    main()
