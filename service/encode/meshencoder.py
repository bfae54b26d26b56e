"""The paper's encoder of meshes that share the template's connectivity (section 4.1)."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from service.encode.alignment import align
from service.encode.session import open_session
from service.errors import ModelFault
from service.mesh.surface import RADIUS
from service.template.anatomy import JOINTS, PARENTS
from service.template.skinned import SHAPES, Body, SkinnedTemplate
from service.template.skinning import orthonormal

Array = NDArray[np.float64]

MESH_SUFFIX = ".mesh.onnx"
"""Its file is called the category's name and this."""
TORSO = ("pelvis", "spine1", "spine2", "spine3")
"""Joints whose part of the surface tells how a body is turned."""


class MeshEncoder:
    """A loaded network: the template's vertices in their order in, rotations and shape out."""

    def __init__(
        self, path: Path, template: SkinnedTemplate, threads: int = 1, digest: str | None = None
    ) -> None:
        """
        Args:
            path: the ONNX file.
            template: the body that it was trained with.
            threads: that one encoding may use.
            digest: of the file, see `open_session`.

        Raises:
            ModelFault: when the file is no such network, or takes another number of vertices.
        """
        self._session = open_session(path, threads, digest)
        self._template = template
        self._faces = faces_digest(template.faces)
        shape = self._session.get_inputs()[0].shape
        if list(shape) != [1, len(template.rest), 3]:
            raise ModelFault(
                "model_shape",
                f"{path.name} takes {shape}, not [1, {len(template.rest)}, 3]",
                "Export the model again, with this body.",
            )

    def matches(self, faces: NDArray[np.int64]) -> bool:
        """Whether ``faces [F, 3]`` are the template's, in its order or another."""
        return faces.shape == self._template.faces.shape and faces_digest(faces) == self._faces

    def encode(self, vertices: Array) -> Body:
        """The body of ``vertices [V, 3]``, in their frame."""
        template = self._template
        turn, scale, _ = align(vertices, template.rest, torso_weights(template))
        (outputs,) = self._session.run(
            None, {"vertices": normalised(vertices @ turn.T).astype(np.float32)[None]}
        )
        numbers = np.asarray(outputs[0], dtype=np.float64)
        count = len(JOINTS)
        turned = turn.T @ orthonormal(numbers[: 6 * count].reshape(count, 6))
        parents = np.concatenate([np.eye(3)[None], turned[list(PARENTS[1:])]])
        body = Body(
            rotations=parents.transpose(0, 2, 1) @ turned,
            shape=numbers[6 * count : 6 * count + SHAPES],
            scale=float(1.0 / scale),
            translation=np.zeros(3),
        )
        return Body(
            body.rotations, body.shape, body.scale, (vertices - template.decode(body)).mean(axis=0)
        )


def normalised(vertices: Array) -> Array:
    """``[V, 3]`` about their mean, the farthest at radius 0.6."""
    away = vertices - vertices.mean(axis=0)
    return np.asarray(away * (RADIUS / np.linalg.norm(away, axis=1).max()))


def torso_weights(template: SkinnedTemplate) -> Array:
    """``[V]`` how much of each vertex moves with the torso."""
    columns = [JOINTS.index(name) for name in TORSO]
    return np.asarray(template.weights[:, columns].sum(axis=1))


def faces_digest(faces: NDArray[np.int64]) -> str:
    """A digest of ``faces [F, 3]``, whatever their order and whichever corner each begins with."""
    first = faces.argmin(axis=1)
    corners = (first[:, None] + np.arange(3)) % 3
    begun = np.take_along_axis(faces, corners, axis=1)
    sorted_faces = begun[np.lexsort(begun.T[::-1])]
    return hashlib.sha256(np.ascontiguousarray(sorted_faces, dtype="<i8").tobytes()).hexdigest()
