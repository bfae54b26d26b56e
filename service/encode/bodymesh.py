"""Bodies whose mesh has the template's own connectivity: read vertex by vertex, not by samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.encode.bodyestimate import (
    PLAUSIBLE,
    SIGMA_ENCODER,
    SIGMA_FLOOR,
    BodyEstimate,
    opposes,
)
from service.encode.bodysamples import LOG_SCALE
from service.encode.correspondence import fit_vertices
from service.encode.distance import Cloud, mesh_distance
from service.encode.meshencoder import MeshEncoder
from service.mesh.surface import Normalization, Samples
from service.stages import stage
from service.template.skinned import NAMES, SkinnedTemplate

Array = NDArray[np.float64]


def estimate_mesh(
    template: SkinnedTemplate,
    encoder: MeshEncoder,
    vertices: Array,
    samples: Samples,
    refined: bool,
    metre: float | None = None,
) -> BodyEstimate:
    """Infer a body from all of its vertices.

    Args:
        template: the body.
        encoder: it `matches` the mesh.
        vertices: ``[V, 3]`` of the mesh in the template's order, in the frame of the samples.
        samples: of the mesh, in canonical orientation, any scale and place.
        refined: go on from the encoder's answer by a fit of vertex to vertex.
        metre: its length in the unit of the samples, if the file tells; it is believed if the body
            then has a usual size.
    """
    normalization = Normalization.of(samples.points)
    own = normalization.apply(vertices)
    with stage("encode"):
        start = encoder.encode(own)
    cloud = Cloud(normalization.apply(samples.points), samples.normals)
    inside_out = opposes(template, start, cloud)
    if inside_out:
        cloud = Cloud(cloud.points, -cloud.normals)
    distance = mesh_distance(template.decode(start), template.faces, cloud)
    sigma = np.full(len(NAMES), SIGMA_ENCODER)
    if not refined:
        return BodyEstimate(start, sigma, distance, distance, normalization, inside_out)
    known = None if metre is None else normalization.scale * metre
    if known is not None and not PLAUSIBLE[0] < known / start.scale < PLAUSIBLE[1]:
        known = None
    with stage("refine"):
        fit = fit_vertices(template, start, own, None if known is None else float(np.log(known)))
        final = mesh_distance(template.decode(fit.body), template.faces, cloud)
    sigma = np.hypot(np.sqrt(np.diag(fit.covariance))[:LOG_SCALE], SIGMA_FLOOR)
    return BodyEstimate(fit.body, sigma, final, distance, normalization, inside_out)
