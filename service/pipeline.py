"""Infer and edit as plain functions of bytes and values: what every interface calls."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.deform import blend, paper
from service.deform.binding import Binding
from service.deform.dimensions import Dimensions
from service.deform.flips import count_flips
from service.edits import Change
from service.encode.model import Model
from service.encode.recognition import Candidate, recognise
from service.errors import InvalidRequest
from service.mesh.convert import convert
from service.mesh.formats import MEDIA_TYPES, read_mesh
from service.mesh.frame import AUTO, orientations
from service.mesh.meshfile import MeshFile
from service.mesh.surface import Samples, sample_surface

Array = NDArray[np.float64]

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
"""Length of each unit in metres."""
METRIC = ("glb", "gltf")
"""Formats whose unit is the metre, by their specification."""
MODES = ("blend", "paper")
CLOSE_CALL = 1.1
"""Two orientations whose fits are within this factor of each other are a close call."""
MANY_FLIPS = 1e-3
"""Share of flipped faces above which an answer says so."""
PLAUSIBLE = (0.1, 100.0)
"""Sizes in metres outside of which a unit must be wrong."""


@dataclass(frozen=True)
class Upload:
    """A file as it came."""

    data: bytes
    name: str | None = None
    content_type: str | None = None

    @cached_property
    def mesh_id(self) -> str:
        """Content address: ``sha256-<hex>``."""
        return f"sha256-{hashlib.sha256(self.data).hexdigest()}"


@dataclass(frozen=True)
class InferOptions:
    """What a client may say of its upload; see the HTTP contract."""

    category: str = AUTO
    up: str = AUTO
    front: str = AUTO
    units: str = "m"
    refine: bool = True


@dataclass(frozen=True)
class EditOptions:
    """How an edit is carried out; `keep` and `format` default to the category's and the file's."""

    mode: str = "blend"
    keep: str | None = None
    format: str | None = None


@dataclass(frozen=True)
class Inference:
    """An upload's parameters, and the way between its frame and the normalised one.

    Attributes:
        upload, mesh: the file, as bytes and read.
        candidates: readings of it, best first.
        unit: that lengths are reported in.
        unit_scale: that unit, per unit of the file.
        warnings: for the client.
    """

    upload: Upload
    mesh: MeshFile
    candidates: list[Candidate]
    unit: str
    unit_scale: float
    warnings: list[str] = field(default_factory=list)

    @property
    def best(self) -> Candidate:
        """The reading that counts."""
        return self.candidates[0]

    @property
    def model(self) -> Model:
        """Its category."""
        return self.best.model

    @property
    def scale(self) -> float:
        """Normalised length per reported length."""
        return self.best.estimate.normalization.scale / self.unit_scale

    @cached_property
    def vertices(self) -> Array:
        """``[V, 3]`` of the mesh in the normalised canonical frame."""
        canonical = self.mesh.vertices @ self.best.orientation.rotation.T
        return self.best.estimate.normalization.apply(canonical)

    @property
    def parameters(self) -> Array:
        """``[d]`` in the reported unit."""
        return self.best.estimate.parameters / self.scale

    def dimensions(self, jacobian: NDArray[np.floating] | None = None) -> Dimensions:
        """The mesh's dimensions in the reported unit."""
        template = self.model.template
        still = np.zeros((len(self.vertices), 3, len(template.parameters)), np.float32)
        moves = still if jacobian is None else jacobian
        return Dimensions(template, self.parameters, self.vertices / self.scale, moves)

    def report(self) -> dict[str, Any]:
        """The answer to `POST /infer`."""
        best, fit = self.best, self.best.estimate
        named = zip(self.model.template.names, self.parameters, fit.sigma / self.scale, strict=True)
        derived = self.dimensions().derived(self.parameters)
        score = self.model.score(fit.distance)
        return {
            "mesh_id": self.upload.mesh_id,
            "category": self.model.name,
            "parameters": {
                name: {"value": float(value), "sigma": float(sigma), "unit": self.unit}
                for name, value, sigma in named
            },
            "derived": {n: {"value": v, "unit": self.unit} for n, v in derived.items()},
            "frame": {
                "up": best.orientation.up,
                "front": best.orientation.front,
                "scale": fit.normalization.scale,
                "center": (fit.normalization.center @ best.orientation.rotation).tolist(),
            },
            "fit": {
                "distance": fit.distance,
                "encoder_distance": fit.encoder_distance,
                "in_distribution": score >= 0.5,
                "score": score,
                "candidates": [
                    {
                        "category": candidate.model.name,
                        "up": candidate.orientation.up,
                        "front": candidate.orientation.front,
                        "distance": candidate.estimate.distance,
                    }
                    for candidate in self.candidates
                ],
            },
            "model": {
                "name": self.model.name,
                "version": self.model.version,
                "digest": self.model.digest,
            },
            "warnings": self.warnings,
        }


@dataclass(frozen=True)
class Edited:
    """An edited file and what became of it.

    Attributes:
        data, format, media_type: the file.
        parameters: values after the edit, by name, derived ones included.
        report: values and dimensions before and after, moved vertices, flipped faces, warnings.
    """

    data: bytes
    format: str
    media_type: str
    parameters: dict[str, float]
    report: dict[str, Any]


def infer(upload: Upload, models: Mapping[str, Model], options: InferOptions) -> Inference:
    """Infer the semantic parameters of an upload.

    Raises:
        ShapeError: for a file that can't be served, or an option that makes no sense.
    """
    chosen = _categories(models, options.category)
    if options.units not in UNITS:
        raise InvalidRequest(
            "unknown_units",
            f"units={options.units[:40]!r} is no unit of length here",
            f"Use one of {', '.join(UNITS)}.",
        )
    ways = orientations(options.up, options.front)
    mesh = read_mesh(upload.data, upload.name, upload.content_type)
    samples = {model.points: _sample(mesh, model.points) for model in chosen}
    candidates = recognise(chosen, samples, ways, options.refine)
    # glTF is in metres whatever the client's unit; other files are in the unit it names.
    unit_scale = 1.0 / UNITS[options.units] if mesh.format in METRIC else 1.0
    found = Inference(upload, mesh, candidates, options.units, unit_scale)
    return replace(found, warnings=_warnings(found))


def edit(
    upload: Upload,
    models: Mapping[str, Model],
    options: InferOptions,
    edits: Mapping[str, Change],
    edit_options: EditOptions,
) -> Edited:
    """Edit an upload's parameters and move its vertices accordingly.

    Raises:
        ShapeError: as `infer`, and for an edit that can't be made.
    """
    found = infer(upload, models, options)
    keep = _check(found.model, edit_options)
    binding = _bind(found, edit_options.mode)
    dimensions = found.dimensions(binding.jacobian)
    after = dimensions.after(edits)
    change = (after - found.parameters) * found.scale
    change[after == found.parameters] = 0.0
    _, anchor = found.model.template.anchor(keep)
    moved = binding.displace(change) - (anchor @ change)
    rotation, scale = found.best.orientation.rotation, found.best.estimate.normalization.scale
    vertices = found.mesh.vertices + (moved / scale) @ rotation
    linear = rotation.T @ binding.linear(change) @ rotation
    return _edited(found, dimensions, after, vertices, linear, edit_options.format)


def _edited(
    found: Inference,
    dimensions: Dimensions,
    after: Array,
    vertices: Array,
    linear: NDArray[np.floating],
    format: str | None,
) -> Edited:
    mesh = found.mesh
    if format is None or format == mesh.format:
        data, format, media_type = mesh.write(vertices, linear), mesh.format, mesh.media_type
    else:
        factor = _file_unit(found, format) / _file_unit(found, mesh.format)
        data = convert(vertices / factor, mesh.faces, format)
        media_type = next(kind for kind, name in MEDIA_TYPES.items() if name == format)
    names = found.model.template.names
    derived = dimensions.derived(found.parameters), dimensions.derived(after)
    flips = count_flips(mesh.vertices, vertices, mesh.faces, linear)
    values = dict(zip(names, map(float, after), strict=True))
    report = {
        "category": found.model.name,
        "model": found.report()["model"],
        "parameters": {
            name: {"before": float(old), "after": float(new), "unit": found.unit}
            for name, old, new in zip(names, found.parameters, after, strict=True)
        },
        "derived": {
            name: {"before": derived[0][name], "after": derived[1][name], "unit": found.unit}
            for name in derived[0]
        },
        "vertices": {
            "total": len(vertices),
            "moved": int((vertices != mesh.vertices).any(axis=1).sum()),
        },
        "flipped_faces": flips,
        "warnings": [*found.warnings, *_edit_warnings(found, after, flips, len(mesh.faces))],
    }
    return Edited(data, format, media_type, values | derived[1], report)


def _categories(models: Mapping[str, Model], category: str) -> list[Model]:
    if category == AUTO:
        return list(models.values())
    if category not in models:
        raise InvalidRequest(
            "unknown_category",
            f"no category is named {category[:80]!r}",
            f"Use one of {', '.join(models)}, or auto.",
        )
    return [models[category]]


def _check(model: Model, options: EditOptions) -> str:
    """Validate an edit's options; the anchor to keep."""
    if options.mode not in MODES:
        raise InvalidRequest(
            "unknown_mode", f"mode={options.mode[:40]!r} is no mode", f"Use {' or '.join(MODES)}."
        )
    anchors = list(model.template.anchors)
    if options.keep is not None and options.keep not in anchors:
        raise InvalidRequest(
            "unknown_keep",
            f"a {model.name} can't keep {options.keep[:40]!r}",
            f"Use one of {', '.join(anchors)}.",
        )
    return options.keep or anchors[0]


def _bind(found: Inference, mode: str) -> Binding:
    rule = blend.bind if mode == "blend" else paper.bind
    fit = found.best.estimate
    return rule(
        found.vertices, found.mesh.faces, found.model.template, fit.parameters, fit.translation
    )


def _file_unit(found: Inference, format: str) -> float:
    """Metres per unit of a file of that format."""
    return 1.0 if format in METRIC else UNITS[found.unit]


def _sample(mesh: MeshFile, points: int) -> Samples:
    """The same samples for the same mesh, always."""
    return sample_surface(mesh.vertices, mesh.faces, points, np.random.default_rng(0))


def _edit_warnings(found: Inference, after: Array, flips: int, faces: int) -> list[str]:
    template = found.model.template
    before = template.broken_relations(found.parameters)
    broken = [text for text in template.broken_relations(after) if text not in before]
    warnings = [f"parts now run into each other: {text} is negative" for text in broken]
    if flips > MANY_FLIPS * faces:
        warnings.append(
            f"{flips} faces turned inside out: the edit is more than this mesh can follow"
        )
    return warnings


def _warnings(found: Inference) -> list[str]:
    warnings = []
    ranks = [candidate.rank for candidate in found.candidates if candidate.model is found.model]
    if len(ranks) > 1 and ranks[1] < CLOSE_CALL * ranks[0]:
        other = found.candidates[1].orientation
        warnings.append(
            f"orientation is a close call: up={other.up}, front={other.front} fits nearly as well; "
            "say up and front to be sure"
        )
    if found.model.score(found.best.estimate.distance) < 0.5:
        warnings.append(
            f"this does not look like a {found.model.name}; its parameters may mean little"
        )
    size = float(np.ptp(found.mesh.vertices, axis=0).max()) * found.unit_scale * UNITS[found.unit]
    if not PLAUSIBLE[0] < size < PLAUSIBLE[1]:
        warnings.append(
            f"the mesh is {size:.3g} m long if its unit is {found.unit}; say units to correct that"
        )
    return warnings
