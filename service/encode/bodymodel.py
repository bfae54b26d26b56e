"""Models of bodies: a skinned template, whose pose and shape are the parameters."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from service.encode.basemodel import Model
from service.encode.bodyestimate import BodyEstimate, estimate_body
from service.encode.bodymesh import estimate_mesh
from service.encode.bodyoutputs import ANCHORS, OUTPUTS, BodyEncoding, spread_first
from service.encode.meshencoder import MESH_SUFFIX, MeshEncoder
from service.mesh.surface import Normalization, Samples, Surface
from service.template.anatomy import GROUPS, JOINTS, limits
from service.template.skinned import SHAPES, SkinnedTemplate

Array = NDArray[np.float64]
Reader = Literal["point", "mesh"]

KEEPS = ("floor", "pelvis")
ORDINARY = 0.7
"""Share of a joint's reach, to either side of none, that a slider spans."""
SPREAD = 3.0
"""Standard deviations that bodies were drawn from, either way,"""
TYPICAL_SPREAD = 2.0
"""and what a slider spans of them."""
ANGLE_STEP, COEFFICIENT_STEP, LENGTH_STEP = 0.01, 0.05, 0.005


class BodyModel(Model):
    """A category of bodies."""

    kind = "skinned"
    turns_freely = True

    def __init__(
        self, card: Mapping[str, Any], template: SkinnedTemplate, path: Path, threads: int
    ):
        """As `Model`, with the body; a card that has a ``mesh_encoder`` has one beside it."""
        super().__init__(card, path, threads)
        self.template = template
        self.mesh_encoder: MeshEncoder | None = None
        # It knows the vertices of the body that it was trained with, and of no other.
        if "mesh_encoder" in card and not self.other_body:
            digest = card["mesh_encoder"]["digest"]
            mesh_path = path.with_suffix(MESH_SUFFIX)
            self.mesh_encoder = MeshEncoder(mesh_path, template, threads, digest)

    @property
    def template_digest(self) -> str:
        """Digest of the body at work, which may be another than the card's."""
        return self.template.digest

    @property
    def label(self) -> str:
        return self.template.label

    @property
    def keeps(self) -> tuple[str, ...]:
        return KEEPS

    @property
    def outputs(self) -> int:
        return OUTPUTS

    @property
    def other_body(self) -> bool:
        """Whether the encoder was trained with another body than the one at work."""
        return bool(self.card.get("template_digest") != self.template.digest)

    @property
    def points(self) -> int:
        """Samples of a mesh that are looked at: the encoder sees fewer than the refinement."""
        return max(self.template.points, self._session.points)

    def encode(self, points: NDArray[np.floating]) -> BodyEncoding:
        """What the encoder answers for a normalised cloud ``[points, 3]``."""
        # Samples come in the order of the faces: spread the choice over all of them.
        chosen = np.linspace(0, len(points) - 1, self._session.points).round().astype(np.int64)
        cloud = np.asarray(points, dtype=np.float64)[chosen]
        return BodyEncoding.of(self._session.run(cloud[spread_first(cloud, ANCHORS)]))

    def reader(self, faces: NDArray[np.int64]) -> Reader:
        """Which encoder reads a mesh of ``faces [F, 3]``: ``mesh`` if they are the template's."""
        return "point" if self._mesh_encoder_of(faces) is None else "mesh"

    def _mesh_encoder_of(self, faces: NDArray[np.int64]) -> MeshEncoder | None:
        encoder = self.mesh_encoder
        return encoder if encoder is not None and encoder.matches(faces) else None

    def estimate(
        self, samples: Samples, refined: bool, rough: bool = False, surface: Surface | None = None
    ) -> BodyEstimate:
        if surface is None:
            return estimate_body(self, samples, refined, rough)
        encoder = self._mesh_encoder_of(surface.faces)
        if encoder is None:
            return estimate_body(self, samples, refined, rough, surface.metre)
        vertices, metre = surface.canonical, surface.metre
        return estimate_mesh(self.template, encoder, vertices, samples, refined, metre)

    def golden_cloud(self) -> NDArray[np.float32]:
        return golden_cloud(self._session.points)

    def entries(self) -> list[dict[str, Any]]:
        low, high = limits()
        entries = []
        for joint, name in enumerate(JOINTS):
            share = ORDINARY if joint else 1.0
            for axis, least, most in zip("xyz", low[joint], high[joint], strict=True):
                entries.append(
                    _entry(
                        f"{name}_{axis}" if joint else f"global_orient_{axis}",
                        f"{_spoken(name) if joint else 'Whole body'}, about {axis}",
                        _group(name),
                        ("rad", "angle", ANGLE_STEP),
                        (least, most),
                        (share * least, share * most),
                    )
                )
        coefficient = ("1", "coefficient", COEFFICIENT_STEP)
        for index, label in enumerate(self.template.shape_labels):
            ends, typical = (-SPREAD, SPREAD), (-TYPICAL_SPREAD, TYPICAL_SPREAD)
            entries.append(_entry(f"shape_{index}", label, "shape", coefficient, ends, typical))
        length = ("m", "length", LENGTH_STEP)
        ends, typical = self._statures(SPREAD), self._statures(TYPICAL_SPREAD)
        label = "Body height, standing"
        return [*entries, _entry("stature", label, "shape", length, ends, typical, derived=True)]

    def _statures(self, spread: float) -> tuple[float, float]:
        """Statures in metres so many standard deviations from the mean, the lesser first."""
        first = np.eye(SHAPES)[0]
        ends = [stature(self.template, sign * spread * first) for sign in (-1.0, 1.0)]
        return min(ends), max(ends)


def stature(template: SkinnedTemplate, shape: Array) -> float:
    """Height in the template's metres of a body of ``shape [S]`` that stands as at rest."""
    return float(np.ptp(template.shaped(shape)[0][:, 1]))


def _entry(
    name: str,
    label: str,
    group: str,
    measure: tuple[str, str, float],
    ends: tuple[float, float],
    typical: tuple[float, float],
    derived: bool = False,
) -> dict[str, Any]:
    unit, kind, step = measure
    return {
        "name": name,
        "label": label,
        "group": group,
        "unit": unit,
        "kind": kind,
        "range": [float(end) for end in ends],
        "typical": [float(end) for end in typical],
        "step": step,
        "derived": derived,
        "paper_name": None,
    }


def _spoken(joint: str) -> str:
    """``left_elbow`` as "Left elbow", ``spine1`` as "Spine 1"."""
    text = joint.replace("_", " ").replace("spine", "spine ")
    return text[0].upper() + text[1:]


def _group(joint: str) -> str:
    return next((group for group, joints in GROUPS.items() if joint in joints), "overall")


def golden_cloud(points: int) -> NDArray[np.float32]:
    """A fixed normalised cloud ``[points, 3]``, upright as bodies are.

    It is the same for every body file: a card's golden answer must hold with an operator's own.
    """
    cloud = (np.random.default_rng(0).random((points, 3)) - 0.5) * [0.5, 1.0, 0.2]
    return Normalization.of(cloud).apply(cloud).astype(np.float32)
