"""Times by size as Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

Row = dict[str, Any]

SHOWN = (
    "read", "encode", "refine", "bind", "transfer", "write",
    "edit of a new file", "edit of a bound mesh", "copying the file",
)  # fmt: skip


def speed_table(rows: Sequence[Row]) -> str:
    """A table a category: a line for each stage, a column for each size; ms of the median and of
    the 95th percentile, with one thread and, where it differs, with two."""
    parts = ["# Speed", "ms, p50 / p95; after a semicolon with two threads in place of one."]
    for category in dict.fromkeys(row["category"] for row in rows):
        parts += [f"## {category}", _table([row for row in rows if row["category"] == category])]
    return "\n\n".join(parts) + "\n"


def _table(rows: Sequence[Row]) -> str:
    sizes = sorted({row["vertices"] for row in rows})
    head = ["", *(f"{_thousands(size)} vertices" for size in sizes)]
    lines = [head, ["---"] * len(head)]
    by_size = [[row for row in rows if row["vertices"] == size] for size in sizes]
    lines.append(["file, MB", *(f"{own[0]['bytes'] / 1e6:.2f}" for own in by_size)])
    for stage in SHOWN:
        cells = ["; ".join(_times(row, stage) for row in own) for own in by_size]
        lines.append([stage, *cells])
    ratios = ["; ".join(_ratio(row) for row in own) for own in by_size]
    lines.append(["a bound mesh's edit, in copies of the file", *ratios])
    memory = ["; ".join(f"{row['memory'] / 2**20:.0f}" for row in own) for own in by_size]
    lines.append(["peak memory, MiB", *memory])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _thousands(count: int) -> str:
    return f"{count / 1e3:.1f}k" if count < 1e5 else f"{count / 1e3:.0f}k"


def _times(row: Row, stage: str) -> str:
    found = row["stages"].get(stage)
    if found is None:
        return "-"
    return " / ".join(_ms(1e3 * found[share]) for share in ("p50", "p95"))


def _ms(value: float) -> str:
    return f"{value:.0f}" if value >= 9.95 else f"{value:.1f}" if value >= 0.95 else f"{value:.2f}"


def _ratio(row: Row) -> str:
    stages = row["stages"]
    return f"{stages['edit of a bound mesh']['p50'] / stages['copying the file']['p50']:.0f}"
