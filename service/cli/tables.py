"""Reports as tables for people."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from service.cli.quantities import METRES

Report = Mapping[str, Any]

NUMBERS = ("value", "±", "before", "after", "change", "_x", "_y", "_z")
"""Columns that are flush right."""
BAR = 16
"""Columns of a range bar."""


def inferred(report: Report, category: Report) -> list[RenderableType]:
    """What `infer` found: each value with its sigma, and where it lies among typical ones; the
    angles of a body's joint on a line."""
    entries = {entry["name"]: entry for entry in category["parameters"]}
    rows = {**report["parameters"], **report["derived"]}
    angles = {name: row for name, row in rows.items() if row["unit"] == "rad"}
    table = _table("parameter", "value", "±", "unit", "typical", "")
    for name, found in rows.items():
        if name in angles:
            continue
        value, sigma = found["value"], found.get("sigma")
        table.add_row(
            name,
            _number(value, sigma),
            "" if sigma is None else _number(sigma, sigma),
            _unit(found["unit"]),
            *_range(value, found["unit"], entries.get(name)),
        )
    tables = [_joints(angles), table] if angles else [table]
    return [_headline(report), *tables, *warnings(report["warnings"])]


def _joints(angles: Report) -> Table:
    """Angles named ``<joint>_x``, ``_y`` and ``_z``, in radians and degrees."""
    table = _table("rad (°)", "_x", "_y", "_z")
    joints = dict.fromkeys(name.rpartition("_")[0] for name in angles)
    for joint in joints:
        found = [angles.get(f"{joint}_{axis}") for axis in "xyz"]
        cells = [
            "" if row is None else f"{row['value']:.3f} ({math.degrees(row['value']):3.0f})"
            for row in found
        ]
        table.add_row(joint, *cells)
    return table


def edited(report: Report, written: str | None) -> list[RenderableType]:
    """What an edit did: values before and after, where they changed.

    Args:
        report: of the edit.
        written: where it went; None when it went nowhere.
    """
    table = _table("", "before", "after", "unit", "change", "")
    measured = report["dimensions"]
    rows = {**report["parameters"], **report["derived"], **measured}
    for name, row in rows.items():
        before, after, asked = row["before"], row["after"], row.get("asked")
        if math.isclose(before, after, rel_tol=1e-9, abs_tol=1e-12) and asked is None:
            continue
        table.add_row(
            name,
            _number(before),
            Text(_number(after), style="bold"),
            _unit(row["unit"]),
            _change(before, after, row["unit"]),
            ", ".join(_notes(name in measured, asked)),
        )
    moved, total = report["vertices"]["moved"], report["vertices"]["total"]
    flips = report["flipped_faces"]
    told = f"{report['category']}: {moved:,} of {total:,} vertices moved" + (
        f", {flips:,} faces turned over" if flips else ""
    )
    head = Text(told if written is None else f"{told} -> ")
    head.append(written or "", style="bold")
    return [head, *([table] if table.row_count else []), *warnings(report["warnings"])]


def augmented(summary: Report) -> list[RenderableType]:
    """What a batch did."""
    counts = {
        "meshes": summary["sources"],
        "done before": summary["kept"],
        "done": summary["done"],
        "of these failed": summary["failed"],
        "variants": summary["ok"],
        "rejected": summary["rejected"],
    }
    table = Table(box=None, pad_edge=False, show_header=False, padding=(0, 2, 0, 0))
    for name, count in counts.items():
        table.add_row(name, f"{count:,}")
    failures = [
        Text(f"Failed: {entry['file']}: {entry['code']}: {entry['detail']}", style="red")
        for entry in summary["failures"]
    ]
    where = f"{summary['out']}   {summary['seconds']:.1f} s"
    return [Text(where, style="bold"), table, *failures]


def categories(entries: Iterable[Report]) -> Table:
    """All categories."""
    table = _table("category", "", "model", "parameters", "keep")
    for entry in entries:
        names = [p["name"] for p in entry["parameters"] if not p["derived"]]
        shown = ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
        versions = ", ".join(
            version["version"] + ("" if version["default"] else f" ({version['name']})")
            for version in entry["versions"]
        )
        table.add_row(entry["name"], entry["label"], versions, shown, ", ".join(entry["keep"]))
    return table


def category(entry: Report) -> list[RenderableType]:
    """One category with its parameters."""
    table = _table("parameter", "", "unit", "typical", "range")
    for parameter in entry["parameters"]:
        table.add_row(
            parameter["name"],
            parameter["label"] + (" (derived)" if parameter["derived"] else ""),
            parameter["unit"],
            _ends(parameter["typical"], 1.0),
            _ends(parameter["range"], 1.0),
        )
    head = Text(f"{entry['label']}: {entry['name']} {entry['model']['version']}")
    head.append(f"; keeps {', '.join(entry['keep'])}", style="dim")
    return [head, table]


def jobs(entries: Iterable[Report]) -> Table:
    """Jobs, a line each."""
    table = _table("job", "kind", "status", "made", "created", "expires")
    for job in entries:
        made = f"{job['progress']['done']} of {job['progress']['total']}"
        times = job["created"], job["expires"]
        table.add_row(job["id"], job["kind"], job["status"], made, *times)
    return table


def warnings(texts: Iterable[str]) -> list[Text]:
    """Warnings, a paragraph each."""
    return [Text(f"Warning: {text}", style="yellow") for text in texts]


def _headline(report: Report) -> Text:
    fit, frame = report["fit"], report["frame"]
    head = Text(report["category"], style="bold")
    head.append(f" {report['model']['version']}", style="not bold dim")
    variant = fit.get("variant")
    told = [variant] if variant else []
    told += [f"score {fit['score']:.2f}", f"fit within {100 * fit['distance']:.1f} % of the size"]
    told += [f"up {frame['up']}, front {frame['front']}"]
    head.append("   " + ", ".join(told), style="not bold default")
    return head


def _table(*columns: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 2, 0, 0))
    for index, column in enumerate(columns):
        number = column in NUMBERS
        table.add_column(
            column,
            justify="right" if number else "left",
            no_wrap=True,
            style="cyan" if index == 0 else "",
        )
    return table


def _number(value: float, sigma: float | None = None) -> str:
    """A value with two digits of its sigma, or with four of its own."""
    measure = sigma or abs(value)
    if not 1e-6 < measure < 1e7:
        return f"{value:.4g}"
    digits = (1 if sigma else 3) - math.floor(math.log10(measure))
    return f"{value:,.{min(max(digits, 0), 6)}f}"


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit


def _range(value: float, unit: str, entry: Report | None) -> tuple[str, str]:
    """A bar with the value's place between the typical ends, and the ends."""
    if entry is None:
        return "", ""
    factor = 1.0 / METRES[unit] if unit in METRES else 1.0
    low, high = (factor * end for end in entry["typical"])
    place = round((value - low) / (high - low) * (BAR - 1)) if high > low else 0
    cells = ["─"] * BAR
    if 0 <= place < BAR:
        cells[place] = "●"
    else:
        cells[0 if place < 0 else -1] = "◀" if place < 0 else "▶"
    return "".join(cells), _ends(entry["typical"], factor)


def _ends(ends: Iterable[float], factor: float) -> str:
    return " to ".join(f"{factor * end:.3g}" for end in ends)


def _change(before: float, after: float, unit: str) -> str:
    if unit in METRES and before > 0.0:
        return f"{100 * (after / before - 1):+.1f} %"
    return f"{math.degrees(after - before):+.0f}°" if unit == "rad" else f"{after - before:+.3g}"


def _notes(measured: bool, asked: Report | None) -> list[str]:
    words = {"set": "asked", "min": "asked at least", "max": "asked at most"}
    told = [f"{words[kind]} {end:.4g}" for kind, end in (asked or {}).items()]
    return (["on the mesh"] if measured else []) + told
