"""The service's own rules as rivals: the paper's, and the blend."""

from __future__ import annotations

from model_export.rivals.subject import Editor, Rival, Subject, linear
from service.deform import blend, paper


def paper_rule(k: int) -> Rival:
    """The displacement of the `k` nearest template vertices."""

    def bind(subject: Subject) -> Editor:
        s = subject
        return linear(s, paper.bind(s.vertices, s.faces, s.template, s.f, s.t, k=k).jacobian)

    return bind


def blend_rule(subject: Subject) -> Editor:
    """A smooth blend of the parts' affine maps."""
    s = subject
    return linear(s, blend.bind(s.vertices, s.faces, s.template, s.f, s.t).jacobian)
