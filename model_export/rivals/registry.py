"""The rivals by name."""

from __future__ import annotations

from dataclasses import dataclass

from model_export.rivals.cage import caged
from model_export.rivals.carried import blend_rule, paper_rule
from model_export.rivals.radial import radial
from model_export.rivals.resynthesis import resynthesised
from model_export.rivals.rigid import as_rigid_as_possible
from model_export.rivals.scaling import global_scale, nine_slice
from model_export.rivals.subject import Rival


@dataclass(frozen=True)
class Entry:
    """A rival.

    Attributes:
        rule: what it does.
        knows_truth: it is shown the true edit and gives a bound; parameters are nothing to it.
        makes_anew: the mesh that it answers with is another.
        limit: seconds for one mesh, binding and all edits.
        apart: it runs in a process of its own, as its library may crash or not come back.
        slow: it is left out of quick runs.
        most: inputs of a source that it is asked for, where that takes long.
    """

    rule: Rival
    knows_truth: bool = False
    makes_anew: bool = False
    limit: float = 120.0
    apart: bool = False
    slow: bool = False
    most: int | None = None


RIVALS: dict[str, Entry] = {
    "global scale": Entry(global_scale),
    "nine-slice": Entry(nine_slice),
    "cage (bound)": Entry(caged, knows_truth=True),
    "re-synthesis (bound)": Entry(
        resynthesised, knows_truth=True, makes_anew=True, apart=True, slow=True, most=4
    ),
    "as-rigid-as-possible": Entry(as_rigid_as_possible, apart=True, slow=True),
    "radial basis": Entry(radial),
    "paper, k = 1": Entry(paper_rule(1)),
    "paper, k = 8": Entry(paper_rule(8)),
    "paper, k = 32": Entry(paper_rule(32)),
    "blend": Entry(blend_rule),
}
