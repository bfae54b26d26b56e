"""Sliders of bodies: a skeleton to turn, and morph targets of the shape."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from service.bodyconstraints import STATURE
from service.bodyedit import ANGLES, standing
from service.bodyinference import BodyInference
from service.deform.skinbinding import SkinBinding, sparse_rows
from service.errors import InvalidRequest
from service.mesh.convert import convert
from service.mesh.embedding import as_glb
from service.mesh.glb import GlbFile
from service.mesh.polygons import Indices
from service.mesh.rig import Joint, Rig, add_rig
from service.mesh.stretch import Stretch
from service.mesh.targets import Target, add_targets
from service.mesh.unskin import unskinned
from service.requests import RESTS, UNITS, SliderOptions, file_unit
from service.skeleton import Skeleton, joint_nodes
from service.sliders import Slider, chosen, notes, targets_of
from service.stages import stage
from service.template.anatomy import JOINTS, PARENTS
from service.template.jointnames import JOINT_NAMES
from service.template.skinned import NAMES, SHAPES, Body

Array = NDArray[np.float64]


def sliders(found: BodyInference, options: SliderOptions, keep: str) -> bytes:
    """The mesh as a GLB with a skeleton and shape morphs.

    Args:
        found: the upload.
        options: what to offer, and how.
        keep: what stays in place when the shape changes.

    Raises:
        InvalidRequest: for an unknown parameter, set of joint names or rest pose.
    """
    binding = found.skin
    with stage("write"):
        file, of = as_glb(found.mesh, file_unit(found.mesh.format, found.unit))
        return _Rigged(found, binding, options, keep, of).write(unskinned(file))


def template(found: BodyInference, options: SliderOptions, keep: str) -> bytes:
    """The fitted body as a GLB in the upload's frame, with the same skeleton and morphs."""
    body = found.model.template
    posed = body.decode(found.fit.body)
    shapedirs = body.shapedirs[:, :, :SHAPES]
    binding = SkinBinding(body, posed, csr_array(sparse_rows(body.weights)), shapedirs)
    own = found.best.orientation.to_own(found.fit.normalization.invert(posed))
    own *= file_unit(found.mesh.format, found.unit)
    with stage("write"):
        file = GlbFile(convert(own, body.faces, "glb"))
        return _Rigged(found, binding, options, keep, np.arange(len(own))).write(file)


class _Rigged:
    """A body's mesh, bound, on its way to a GLB with a skeleton."""

    def __init__(
        self,
        found: BodyInference,
        binding: SkinBinding,
        options: SliderOptions,
        keep: str,
        of: Indices,
    ) -> None:
        """`of` are the bound vertices that the GLB's are."""
        self.found = found
        self.options = options
        self.keep = keep
        self.of = of
        self.names = chosen(NAMES, options.parameters, found.model.name)
        if options.joint_names not in JOINT_NAMES or options.rest not in RESTS:
            raise InvalidRequest(
                "unknown_rig",
                f"there is no rig with joint_names={options.joint_names[:40]!r} and "
                f"rest={options.rest[:40]!r}",
                f"Use one of {', '.join(JOINT_NAMES)}, and one of {', '.join(RESTS)}.",
            )
        self.entries = {entry["name"]: entry for entry in found.model.entries()}
        self.metres = file_unit(found.mesh.format, found.unit)
        self.binding = binding
        self.rest = found.fit.body
        if options.rest == "t_pose":
            self.rest = self._t_pose()

    def write(self, file: GlbFile) -> bytes:
        """The GLB, of one that holds the bound vertices as they came."""
        before = self.found.fit.body
        vertices = self.binding.move(before, self.rest)
        if self.options.rest == "t_pose":
            turn = self.found.best.orientation
            linear = turn.maps_to_own(self.binding.carry(before, self.rest)[1])
            file = GlbFile(file.write(self._own(vertices)[self.of], linear[self.of]))
        offered = [self._slider(name) for name in self.names]
        asset = notes(self.found, self.keep, offered, self._further())
        shapes = [slider for slider in offered if slider.kind == "coefficient"]
        file = GlbFile(
            add_targets(file, self._targets(shapes, vertices), asset, self.options.quantize)
        )
        return add_rig(file, self._rig())

    def _t_pose(self) -> Body:
        """The body with no joint turned, as high above the floor as it was."""
        before = self.found.fit.body
        still = np.tile(np.eye(3), (len(JOINTS), 1, 1))
        after = replace(before, rotations=still)
        lowest = [self.binding.move(before, body)[:, 1].min() for body in (before, after)]
        rise = np.array([0.0, lowest[0] - lowest[1], 0.0])
        return replace(after, translation=after.translation + rise)

    def _own(self, points: Array) -> Array:
        """Normalised points in the GLB's frame, in metres."""
        found = self.found
        own = found.best.orientation.to_own(found.fit.normalization.invert(points))
        return np.asarray(own * self.metres)

    def _targets(self, shapes: Sequence[Slider], vertices: Array) -> Iterator[Target]:
        """The morph targets of the shape: what an edit of each coefficient does at rest."""
        found = self.found
        for slider in shapes:
            moved = self.binding.move(found.fit.body, self._shaped(slider.name))
            shift = (moved - vertices) * self.metres / found.fit.normalization.scale
            shift = found.best.orientation.to_own(shift)
            # What hardly turns anything is left out, as it is of edits.
            yield from targets_of(slider, shift[self.of], Stretch({}), self.options.paired)

    def _shaped(self, name: str) -> Body:
        """The body at rest with one more of a coefficient."""
        step = np.zeros(SHAPES)
        step[NAMES.index(name) - ANGLES] = 1.0
        after = replace(self.rest, shape=self.rest.shape + step)
        return standing(self.found.model.template, self.rest, after, self.keep)

    def _slider(self, name: str) -> Slider:
        index, entry = NAMES.index(name), self.entries[name]
        value, sigma = float(self.rest.parameters[index]), float(self.found.fit.sigma[index])
        return Slider.of(entry, value, sigma, entry["typical"])

    def _further(self) -> dict[str, Any]:
        """The stature, and where the joints are."""
        found = self.found
        entry = self.entries[STATURE]
        unit = UNITS[found.unit]
        value = found.stature(self.rest)
        # Linear in the shape as long as the same vertices are the highest and the lowest.
        heights = found.model.template.shaped(self.rest.shape)[0][:, 1]
        ends = found.model.template.shapedirs[[heights.argmax(), heights.argmin()], 1]
        rises = (ends[0] - ends[1]) * self.rest.scale / found.scale
        shapes = [name for name in NAMES[ANGLES:] if name in self.names]
        coefficients = {name: float(rises[NAMES.index(name) - ANGLES]) for name in shapes}
        parameters = self.rest.parameters
        now = sum(by * parameters[NAMES.index(name)] for name, by in coefficients.items())
        stature = {
            "label": entry["label"],
            "group": entry["group"],
            "unit": found.unit,
            "value": value,
            "range": [end / unit for end in entry["typical"]],
            "constant": float(value - now),
            "coefficients": coefficients,
        }
        return {
            "derived": {STATURE: stature},
            "limits": [],
            "joint_names": self.options.joint_names,
            "rest": self.options.rest,
            "joints": found.further_report()["joints"],
        }

    def _rig(self) -> Rig:
        skeleton = Skeleton.of_binding(self.found, self.binding, self.rest)
        names = JOINT_NAMES[self.options.joint_names]
        apart = self._apart(skeleton)
        joints = [
            Joint(
                name=names[index],
                parent=PARENTS[index],
                rotation=skeleton.rotations[index],
                offset=skeleton.offsets[index] * self.metres,
                extras=self._extras(index, {name: row[index] for name, row in apart.items()}),
            )
            for index in range(len(JOINTS))
        ]
        # Both of points in metres and to points in metres.
        binds = skeleton.inverse_bind.copy()
        binds[:, :3, 3] *= self.metres
        indices, weights = skeleton.indices[self.of], skeleton.weights[self.of]
        return Rig(joints, skeleton.frame, binds, indices, weights)

    def _apart(self, skeleton: Skeleton) -> dict[str, Array]:
        """``[24, 3]`` metres that each offset changes by, for a unit of each coefficient."""
        found = {}
        for name in NAMES[ANGLES:]:
            if name in self.names:
                offsets = joint_nodes(self.found, self._shaped(name))[:, :3, 3]
                found[name] = (offsets - skeleton.offsets) * self.metres
        return found

    def _extras(self, joint: int, apart: Mapping[str, Array]) -> dict[str, Any]:
        angles = [name for name in NAMES[3 * joint : 3 * joint + 3] if name in self.names]
        shape = {name: offset.tolist() for name, offset in apart.items()}
        return {"joint": JOINTS[joint], "parameters": angles, "shape": shape}
