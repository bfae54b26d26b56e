"""One page of all results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from model_export.benchmark.case import FACTORS
from model_export.benchmark.score import BEST
from model_export.benchmark.service_checks import Identity
from model_export.benchmark.tables import NO_TRUTH, TRUTH, by_edit, seconds, table, worst
from service.augment.crossings import DEEP

Row = dict[str, Any]

HEAD = f"""# Benchmark

Every public parameter times {FACTORS[0]} and {FACTORS[1]}.  A cell with three figures is with the
true parameters, with parameters wrong by 5 % either way, and with those that the model infers from
the mesh alone; rivals marked "bound" are fitted to the true edit itself.  Lengths are shares of the
bounding box's diagonal.  EA is the mean error over the mean true motion: 0 is perfect, 1 did
nothing.  An edit is near with EA below {BEST["accuracy"]}, what should stay moved by less than
{BEST["locality"]}, and no face flipped; it has passed if besides less than a thousandth of the
faces are degenerate, and no gap of {BEST["gap"]} or more has opened between pieces that touched
(99th percentile).  A rival that answers with another mesh never passes.  Flips are counted against
the true edit's normals, or the input's where there is no truth.  Crossings are pairs of faces that
run through each other by more than {DEEP} and do so neither in the input nor in the true edit; of
pieces that run into each other already and slide, these are many.  An edit is crossed that has any
between pieces, or within one, that did not run into each other in either.  They are looked for in a
quarter of the edits, the same of every rival; what has passed may be crossed.  In the picture red
is what lies 1 % of the diagonal or more from where it should.

![rivals](rivals.png)
"""
SOURCES = {
    "D": "Detailed shapes, edited by their own generator",
    "S": "The template's own shapes",
    "R": "Real shapes, held out; their true edits nobody knows",
    "O": "What the paper shows of unlike shapes",
}


@dataclass(frozen=True)
class Checks:
    """What the whole service was asked, of some inputs: see `service_checks`."""

    identities: Sequence[Identity]
    mirrored: Sequence[float]
    sliders: Mapping[str, tuple[float, float]]


def write_report(
    rows: Sequence[Row], checks: Mapping[str, Checks], sections: Mapping[str, str], path: Path
) -> None:
    """Write the page; what else was measured comes under titles of its own."""
    parts = [HEAD]
    for source, title in SOURCES.items():
        for category in dict.fromkeys(row["category"] for row in rows):
            own = [r for r in rows if (r["source"], r["category"]) == (source, category)]
            if not own:
                continue
            inputs = len({row["input"] for row in own})
            parts.append(f"## {source}, {category}s: {title}\n\n{inputs} inputs.\n")
            parts.append(table(own, NO_TRUTH if source in "RO" else TRUTH) + "\n")
            if source == "D" and any(row["rival"] == "blend" for row in own):
                parts.append(f"### `blend`, by parameter\n\n{by_edit(own, 'blend', 'true')}\n")
                parts.append(f"### Where `blend` distorts most\n\n{worst(own, 'blend', 'true')}\n")
    parts.append("## The service as a whole\n\n" + _checks(checks) + "\n")
    parts += [f"## {title}\n\n{text}\n" for title, text in sections.items()]
    parts.append("## Time\n\n" + seconds(rows) + "\n")
    path.write_text("\n".join(parts), "utf-8")


def _checks(checks: Mapping[str, Checks]) -> str:
    lines = [
        "| category | empty edit, bytes equal | all else kept | there and back | f, mirrored "
        "| largest / mean step | found again (Spearman) |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, own in checks.items():
        empty = sum(one.empty for one in own.identities)
        kept = sum(one.kept for one in own.identities)
        edits = sum(one.edits for one in own.identities)
        back = np.mean([one.back for one in own.identities])
        steps, again = zip(*own.sliders.values(), strict=True)
        lines.append(
            f"| {name} | {empty} of {len(own.identities)} | {kept} of {edits} | {back:.1e} "
            f"| {max(own.mirrored):.1e} | {max(steps):.3f} | {min(again):.3f} |"
        )
    return "\n".join(lines)
