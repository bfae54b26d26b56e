"""The service's own rules as rivals: the paper's, and the blend."""

from __future__ import annotations

import numpy as np

from model_export.rivals.subject import Editor, Rival, Subject, linear
from service.deform import blend, paper
from service.deform.unfold import Unfolding


def paper_rule(k: int) -> Rival:
    """The displacement of the `k` nearest template vertices."""

    def bind(subject: Subject) -> Editor:
        s = subject
        return linear(s, paper.bind(s.vertices, s.faces, s.template, s.f, s.t, k=k).jacobian)

    return bind


def blend_rule(subject: Subject) -> Editor:
    """A smooth blend of the parts' affine maps, its folds evened out, as the service edits."""
    s = subject
    binding = blend.bind(s.vertices, s.faces, s.template, s.f, s.t)
    assert binding.welded is not None
    unfolding, jacobian = Unfolding(binding.welded), binding.jacobian.copy()
    for index in np.flatnonzero(s.template.public).tolist():
        evened = unfolding.evened(binding.bound([index]), index, float(s.f[index]))
        for (axis, parameter), column in evened.items():
            jacobian[:, axis, parameter] = column
    return linear(s, jacobian)
