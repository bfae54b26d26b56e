"""A file as the service takes it, infers it and edits it, in pictures."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model_export.pictures import BLUE, GREY, YELLOW, Colour, Panel
from service.affineinference import AffineInference
from service.bodyedit import edited, standing
from service.bodyinference import BodyInference
from service.cli.neighbours import gathered
from service.edited import Edited
from service.edits import Change
from service.encode.basemodel import Model
from service.errors import ShapeError
from service.inference import Inference
from service.inferences import Inferences
from service.mesh.formats import read_mesh
from service.pipeline import edit, infer
from service.requests import EditOptions, InferOptions, Upload

Array = NDArray[np.float64]
Faces = NDArray[np.int64]

RED = (0.86, 0.30, 0.22)
OVER = 0.5
"""Opacity of a template that is drawn over the mesh."""
STILL = 1e-5
"""Share of the shape's radius by which nothing visible moves."""
SHORT = 12
"""Letters of a title's last line that leave room for a remark beside it."""
REACHED = 0.02
"""Share by which an edited value may miss what was asked without remark."""


def uploaded(path: Path) -> Upload:
    """A file as a client sends it: with what it names beside it, in a zip then.

    Raises:
        OSError: when it can't be read.
    """
    data = path.read_bytes()
    archive = gathered(path, data, looks=True)
    return Upload(data, path.name) if archive is None else Upload(archive, f"{path.stem}.zip")


@dataclass(frozen=True)
class Subject:
    """An upload, and what the service finds in it.

    Attributes:
        name: told with progress.
        upload: the file.
        models: the categories.
        options: what is said of it.
        known: where its inference is kept from edit to edit.
    """

    name: str
    upload: Upload
    models: Mapping[str, Model]
    options: InferOptions
    known: Inferences

    @cached_property
    def found(self) -> Inference:
        """What `pipeline.infer` answers.

        Raises:
            ShapeError: when the service refuses the file.
        """
        found = infer(self.upload, self.models, self.options, self.known)
        fit, score = found.best.estimate.distance, found.best.score
        _say(self.name, f"{found.model.name}, fit {fit:.4f}, score {score:.2f}")
        for warning in found.warnings:
            _say(self.name, warning)
        return found

    def shown(self, title: str) -> Panel:
        """The upload as it came, in the canonical frame."""
        return Panel(title, [(self.found.vertices, self.found.mesh.faces, YELLOW, 1.0)])

    def fitted(self, title: str) -> Panel:
        """The upload with the fitted template over it."""
        vertices, faces = template_of(self.found)
        if not self.found.in_distribution:
            title = f"{title}\n(not recognised by itself)"
        return Panel(title, [*self.shown("").meshes, (vertices, faces, BLUE, OVER)])

    def template(self, title: str, changes: Mapping[str, Change]) -> Panel:
        """The fitted template after an edit; none leave it as it was fitted."""
        vertices, faces = template_of(self.found, changes)
        return Panel(title, [(vertices, faces, BLUE, 1.0)])

    def edited(self, title: str, changes: Mapping[str, Change]) -> Panel:
        """The upload after an edit, the redder the farther it has moved.

        The title also tells of what `remarks` finds; an edit that is refused shows the upload.
        """
        try:
            answer = edit(
                self.upload, self.models, self._options, changes, EditOptions(), known=self.known
            )
        except ShapeError as error:
            _say(self.name, f"{title}: refused, {error}")
            return self.shown(f"{title}: refused")
        for warning in answer.report["warnings"][len(self.found.warnings) :]:
            _say(self.name, f"{title}: {warning}")
        vertices = self._canonical(answer)
        away = np.linalg.norm(vertices - self.found.vertices, axis=1)
        notes = remarks(answer, changes) if away.max() > STILL else ["nothing moves"]
        beside = len(changes) == 1 and len(title.rpartition("\n")[2]) < SHORT
        title = (", " if beside else "\n").join([title, *notes])
        faces = self.found.mesh.faces
        return Panel(title, [(vertices, faces, tinted(away, faces), 1.0)])

    @property
    def _options(self) -> InferOptions:
        """Of edits: those of what is not recognised have to say the category."""
        found = self.found
        told = replace(self.options, category=found.model.name)
        return self.options if found.in_distribution else told

    def _canonical(self, answer: Edited) -> Array:
        """``[V, 3]`` of an edited file, where `Inference.vertices` are."""
        moved = read_mesh(answer.data, f"{self.name}.{answer.format}").vertices
        best = self.found.best
        return best.estimate.normalization.apply(best.orientation.to_canonical(moved))


def tinted(away: Array, faces: Faces) -> Colour:
    """``[F, 3]`` from grey, for what has stayed, to red, for what has moved the farthest."""
    farthest = away.max(initial=0.0)
    share = away[faces].mean(axis=1) / farthest if farthest > STILL else np.zeros(len(faces))
    grey, red = np.array(GREY), np.array(RED)
    return np.asarray(grey + share[:, None] * (red - grey))


def remarks(answer: Edited, changes: Mapping[str, Change]) -> list[str]:
    """What the picture alone would not tell: values that were not reached, and folds."""
    notes: list[str] = []
    values = answer.report["parameters"] | answer.report["derived"]
    for name, change in changes.items():
        before, after = values[name]["before"], values[name]["after"]
        asked = change.apply(before)
        if abs(after - asked) > REACHED * abs(asked):
            which = "" if len(changes) == 1 else f"{name} "
            notes.append(f"only {which}x {after / before:.2f}")
    if folds := answer.report["flipped_faces"]:
        notes.append(f"{folds} fold{'s' * (folds > 1)}")
    return notes


def template_of(
    found: Inference, changes: Mapping[str, Change] | None = None
) -> tuple[Array, Faces]:
    """The fitted template, perhaps edited, in the normalised canonical frame.

    Returns:
        ``[T, 3]`` vertices and ``[G, 3]`` those of its faces that can be seen.
    """
    changes = changes or {}
    if isinstance(found, BodyInference):
        return _body(found, changes)
    assert isinstance(found, AffineInference)
    template, fit = found.fit.template, found.fit
    outcome = found.dimensions(found.bound("blend")).outcome(changes)
    change = outcome.change * found.scale
    _, anchor = template.anchor(found.model.keeps[0])
    vertices = template.decode(fit.parameters + change) + fit.translation - anchor @ change
    return vertices, template.faces[~template.hidden]


def _body(found: BodyInference, changes: Mapping[str, Change]) -> tuple[Array, Faces]:
    template, body = found.model.template, found.fit.body
    values = found.parameters.copy()
    for index, name in enumerate(found.parameter_report()):
        if name in changes:
            values[index] = changes[name].apply(values[index])
    after = standing(template, body, edited(body, values), found.model.keeps[0])
    return template.decode(after), template.faces


def _say(name: str, text: str) -> None:
    print(f"{name}: {' '.join(text.split())}", file=sys.stderr)
