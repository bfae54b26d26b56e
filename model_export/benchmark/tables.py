"""The results as Markdown."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

Row = dict[str, Any]

KNOWN = ("true", "off", "inferred")
Format = Callable[[float], str]


def _number(digits: int) -> Format:
    def text(value: float) -> str:
        written = f"{value:.{digits}f}"
        return written[1:] if written.startswith("0.") else written

    return text


def _small(value: float) -> str:
    return "0" if value < 1e-9 else f"{value:.1e}".replace("e-0", "e-")


def _share(value: float) -> str:
    return f"{100 * value:.0f}"


TRUTH: dict[str, tuple[str, Format]] = {
    "EA": ("accuracy", _number(3)),
    "p99 EA": ("tail", _number(2)),
    "dimension, %": ("dimension", _number(2)),
    "locality": ("locality", _small),
    "p99 edge ratio": ("edge_tail", _number(2)),
    "flips / 1000": ("flips", _number(1)),
    "gaps": ("gap", _small),
    "crossings / 10k": ("crossings", _number(1)),
    "near, %": ("near", _share),
    "passed, %": ("passed", _share),
    "crossed, %": ("crossed", _share),
}
"""Columns for inputs whose true edits are known: the measure, and how it is written."""
NO_TRUTH: dict[str, tuple[str, Format]] = {
    "Laplacian change": ("detail", _number(3)),
    "flips / 1000": ("flips", _number(1)),
    "degenerate / 1000": ("degenerate", _number(1)),
    "gaps": ("gap", _small),
    "crossings / 10k": ("crossings", _number(1)),
    "asymmetry": ("asymmetry", _small),
    "sound, %": ("passed", _share),
    "crossed, %": ("crossed", _share),
}


def table(rows: Sequence[Row], columns: dict[str, tuple[str, Format]]) -> str:
    """A line a rival; a cell has a figure for each way of knowing the parameters, in order.

    Rivals that were shown the truth, and measures that make no sense for one, have one or none.
    """
    rivals = list(dict.fromkeys(row["rival"] for row in rows))
    lines = ["| rival | " + " | ".join(columns) + " | failed |", "|---" * (len(columns) + 2) + "|"]
    for rival in rivals:
        own = [row for row in rows if row["rival"] == rival]
        groups = [[row for row in own if row["known"] == known] for known in KNOWN]
        groups = [group for group in groups if group] or [own]
        cells = [
            _cell([mean(group, measure) for group in groups], write)
            for measure, write in columns.values()
        ]
        lines.append("| " + " | ".join([rival, *cells, failures(own)]) + " |")
    return "\n".join(lines)


def mean(rows: Iterable[Row], measure: str) -> float | None:
    """Of all edits that were answered; shares are of the others too."""
    rows = list(rows)
    values = [score[measure] for row in rows for score in row["scores"]]
    values = [float(value) for value in values if value is not None]
    if measure in ("near", "passed"):
        return sum(values) / max(sum(row["edits"] for row in rows), 1)
    return float(np.mean(values)) if values else None


def _cell(values: Sequence[float | None], write: Format) -> str:
    texts = ["-" if value is None else write(value) for value in values]
    return texts[0] if len(set(texts)) == 1 else " / ".join(texts)


def failures(rows: Sequence[Row]) -> str:
    """How many inputs came to nothing, and the commonest reason."""
    reasons = [row["failure"] for row in rows if row["failure"]]
    if not reasons:
        return "0"
    commonest = max(set(reasons), key=reasons.count)
    return f"{len(reasons)} of {len(rows)}: {commonest[:60]}"


def by_edit(rows: Sequence[Row], rival: str, known: str) -> str:
    """One rival's figures for each parameter."""
    own = [row for row in rows if row["rival"] == rival and row["known"] == known]
    names = dict.fromkeys(score["edit"] for row in own for score in row["scores"])
    columns = TRUTH
    lines = ["| parameter | " + " | ".join(columns) + " |", "|---" * (len(columns) + 1) + "|"]
    for name in names:
        scores = [s for row in own for s in row["scores"] if s["edit"] == name]
        group = [{"scores": scores, "edits": len(scores)}]
        cells = [_cell([mean(group, measure)], write) for measure, write in columns.values()]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def worst(rows: Sequence[Row], rival: str, known: str, count: int = 10) -> str:
    """The edits whose edges are most distorted."""
    found = [
        (score["edge_tail"], row["input"], score)
        for row in rows
        if row["rival"] == rival and row["known"] == known
        for score in row["scores"]
        if score["edge_tail"] is not None
    ]
    found.sort(key=lambda entry: -entry[0])
    lines = ["| input | edit | p99 edge ratio | EA | locality |", "|---|---|---|---|---|"]
    for edge, name, score in found[:count]:
        lines.append(
            f"| {name} | {score['edit']} x {score['factor']} | {edge:.2f} "
            f"| {_number(3)(score['accuracy'])} | {_small(score['locality'])} |"
        )
    return "\n".join(lines)


def seconds(rows: Sequence[Row]) -> str:
    """Median seconds to bind."""
    rivals = dict.fromkeys(row["rival"] for row in rows)
    lines = ["| rival | bind, median s | longest input, s |", "|---|---|---|"]
    for rival in rivals:
        own = [row for row in rows if row["rival"] == rival]
        bound = np.median([row["bound_s"] for row in own])
        lines.append(f"| {rival} | {bound:.2f} | {max(row['seconds'] for row in own):.1f} |")
    return "\n".join(lines)
