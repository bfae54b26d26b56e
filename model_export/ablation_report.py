"""Tables of ablation runs, beside the paper's figures.

``python -m model_export.ablation_report docs/ablation.jsonl`` prints them as Markdown;
``--json FILE`` writes the figures for the model card (``model_export.export --ablation``).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from model_export.ablation import BOTH, REC, SEM, UNEDITED, read_lines
from model_export.metrics import THRESHOLDS

PAPER = {
    SEM: (35.2, 72.3, 87.2),
    REC: (11.9, 47.9, 77.6),
    UNEDITED: (11.5, 55.0, 83.6),
    BOTH: (40.3, 82.2, 95.4),
}
TITLES = {
    "losses": "With real shapes in each batch (L_sim on)",
    "losses_without_real": "Without real shapes (gamma 0)",
    "variations": "Both losses, the editing branch and real shapes, with one thing changed",
}
TABLES = {
    "losses": "losses",
    "real": "losses_without_real",
    "losses_without_real": "losses_without_real",
    "edits": "variations",
    "norms": "variations",
    "longer": "variations",
}
"""Of the groups of runs: which of `TITLES` they stand under."""

Line = dict[str, Any]


def statistics(lines: Sequence[Line]) -> dict[str, Any]:
    """Mean and standard deviation over the seeds of a row's runs; no deviation of one run."""
    figures: dict[str, Any] = {"seeds": len(lines)}
    for name in ("within_percent", "edited_within_percent", "real_distance_median",
                 "real_distance_mean", "minutes"):  # fmt: skip
        values = np.array([line[name] for line in lines])
        deviation = values.std(axis=0, ddof=1) if len(values) > 1 else np.zeros_like(values[0])
        figures[name] = {"mean": values.mean(axis=0).tolist(), "sd": deviation.tolist()}
    return figures


def summary(lines: Sequence[Line]) -> dict[str, dict[str, Any]]:
    """Statistics of every row of every table that has a run; the paper's rows in its order."""
    order = list(PAPER)
    runs: dict[str, dict[str, list[Line]]] = {}
    for line in sorted(lines, key=lambda line: [*order, line["row"]].index(line["row"])):
        runs.setdefault(TABLES[line["group"]], {}).setdefault(_name(line), []).append(line)
    return {
        table: {name: statistics(found) for name, found in runs[table].items()}
        for table in TITLES
        if table in runs
    }


def _name(line: Line) -> str:
    names = {"edits": f"edits: {line['row']}", "norms": f"norm of L_sem: {line['row']}"}
    return names.get(line["group"], line["row"])


def tables(lines: Sequence[Line]) -> str:
    """Markdown of all runs."""
    found = summary(lines)
    if "variations" in found and BOTH in found.get("losses", {}):
        whole = {"edits: multiply; norm of L_sem: l2": found["losses"][BOTH]}
        found["variations"] = whole | found["variations"]
    return "\n\n".join(f"{TITLES[name]}:\n\n{table(rows)}" for name, rows in found.items())


def table(rows: dict[str, Any]) -> str:
    """Markdown of one table; the paper's figures stand beside the rows that it has."""
    limits = " / ".join(f"{limit:g}"[1:] for limit in THRESHOLDS)
    out = [f"| | runs | edited shapes, {limits} | paper | not edited, {limits} "
           "| real distance, mean / median |", "|---|---|---|---|---|---|"]  # fmt: skip
    for name, row in rows.items():
        paper = " / ".join(map(str, PAPER[name])) if name in PAPER else "-"
        out.append(
            f"| {name} | {row['seeds']} | {_shares(row, 'edited_within_percent')} | {paper} "
            f"| {_shares(row, 'within_percent')} | {_distances(row)} |"
        )
    return "\n".join(out)


def _shares(row: dict[str, Any], name: str) -> str:
    """Three percentages with their spread."""
    means, deviations = row[name]["mean"], row[name]["sd"]
    if row["seeds"] == 1:
        return " / ".join(f"{mean:.1f}" for mean in means)
    pairs = zip(means, deviations, strict=True)
    return " / ".join(f"{mean:.1f} ± {deviation:.1f}" for mean, deviation in pairs)


def _distances(row: dict[str, Any]) -> str:
    """Mean and median distance to held-out real shapes, each with its spread over the runs."""
    figures = [row["real_distance_mean"], row["real_distance_median"]]
    if row["seeds"] == 1:
        return " / ".join(f"{figure['mean']:.4f}" for figure in figures)
    return " / ".join(f"{figure['mean']:.4f} ± {figure['sd']:.4f}" for figure in figures)


def settings(lines: Sequence[Line]) -> str:
    """What the runs have in common, in a line."""
    config = lines[0]["config"]
    minutes = sum(line["minutes"] for line in lines)
    head = "x".join(map(str, config["head"])) if config["head"] else "the paper's"
    return (
        f"{len(lines)} runs of {config['steps']} steps of {config['batch']} clouds of "
        f"{config['points'][0]} points, learning rate {config['learning_rate']}, head {head}, "
        f"{minutes / 60:.1f} hours together, {lines[0]['place']}"
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.ablation_report")
    parser.add_argument("results", type=Path, help="lines that model_export.ablation wrote")
    parser.add_argument("--json", type=Path, help="to write the figures to, for a model card")
    arguments = parser.parse_args()
    lines = read_lines(arguments.results)
    if not lines:
        parser.exit(1, f"there are no results in {arguments.results}\n")
    print(settings(lines), tables(lines), sep="\n\n")
    if arguments.json:
        figures = {"thresholds": THRESHOLDS, "paper": PAPER, "settings": settings(lines)}
        text = json.dumps(figures | {"rows": summary(lines)}, indent=2)
        arguments.json.write_text(text + "\n", "utf-8")


if __name__ == "__main__":
    main()
