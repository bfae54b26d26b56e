"""A model that answers at once, for the tests of those who build on the service."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.encode.affinemodel import AffineModel
from service.encode.distance import Cloud, surface_distance
from service.encode.estimate import Estimate
from service.mesh.surface import Normalization, Samples, Surface
from service.shipped import DEBUG

Array = NDArray[np.float64]


class DebugModel(AffineModel):
    """A category of boxes: the parameters are what the encoder answers, and nothing is fitted.

    The shipped one's encoder measures the extents of a cloud, and the cloud holds the outermost
    vertices of the mesh, so that its parameters are the mesh's own width, height and depth.
    """

    kind = DEBUG
    # No orientation is tried beside the first, and no lean taken out: each would take time.
    turns_freely = True
    recognised = False

    def estimate(
        self, samples: Samples, refined: bool, rough: bool = False, surface: Surface | None = None
    ) -> Estimate:
        """As `Model.estimate`, but that the encoder's answer is taken as it is."""
        normalization = Normalization.of(samples.points)
        points = samples.points if surface is None else outermost(surface, len(samples.points))
        encoding = self.encode(normalization.apply(points))
        parameters, translation = encoding.parameters, encoding.translation
        cloud = Cloud(normalization.apply(samples.points), samples.normals)
        distance = surface_distance(self.template, parameters, translation, cloud)
        return Estimate(
            template=self.template,
            parameters=parameters,
            translation=translation,
            sigma=np.zeros(len(parameters)),
            distance=distance,
            encoder_distance=distance,
            normalization=normalization,
            inside_out=False,
        )


def outermost(surface: Surface, count: int) -> Array:
    """``[count, 3]`` corners of a mesh's faces, canonical: the first and last along each axis, over
    and over."""
    used = np.zeros(len(surface.vertices), dtype=bool)
    used[surface.faces] = True
    corners = surface.canonical[used]
    ends = np.concatenate([corners.argmin(axis=0), corners.argmax(axis=0)])
    return np.asarray(corners[np.resize(ends, count)])
