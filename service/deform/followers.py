"""The template as edits move it: what follows an edited parameter goes along."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from service.template.affine import AffineTemplate

Array = NDArray[np.float64]


def following(template: AffineTemplate, f: Array) -> AffineTemplate:
    """The template with each parameter's followers (see `AffineTemplate.following`) in its columns.

    It is the same at ``f [d]``; away from there it decodes ``f + df`` as the template does
    ``f + template.following(f) @ df``.
    """
    carried = template.following(f)
    rest = f - carried @ f

    def pair(base: Array, jacobian: Array) -> tuple[Array, Array]:
        return base + jacobian @ rest, jacobian @ carried

    base, jacobian = pair(template.base, template.jacobian)
    frame_base, frame_jacobian = pair(template.frame_base, template.frame_jacobian)
    taper_base, taper_jacobian = pair(template.taper_base, template.taper_jacobian)
    return replace(
        template,
        base=base,
        jacobian=jacobian,
        frame_base=frame_base,
        frame_jacobian=frame_jacobian,
        taper_base=taper_base,
        taper_jacobian=taper_jacobian,
    )
