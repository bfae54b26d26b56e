from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from model_export import ablation_report
from model_export.ablation import plain
from model_export.ablation_report import settings, statistics, summary, tables
from model_export.config import Config


def line(group: str, row: str, seed: int, edited: list[float], real: float) -> dict[str, Any]:
    return {
        "group": group,
        "row": row,
        "seed": seed,
        "within_percent": [share / 2 for share in edited],
        "edited_within_percent": edited,
        "real_distance_median": real,
        "real_distance_mean": 2 * real,
        "minutes": 6.0,
        "place": "CPU, threads: 1",
        "config": plain(Config(seed=seed, steps=9)),
    }


LINES = [
    line("losses", "L_sem + L_rec", 0, [40.0, 80.0, 90.0], 0.020),
    line("losses", "L_sem + L_rec", 1, [44.0, 80.0, 92.0], 0.022),
    line("losses", "L_sem", 0, [30.0, 70.0, 80.0], 0.025),
    line("real", "L_sem + L_rec", 0, [50.0, 81.0, 93.0], 0.031),
    line("edits", "cycle", 0, [41.0, 82.0, 94.0], 0.021),
    line("norms", "l1", 0, [20.0, 60.0, 70.0], 0.026),
    line("longer", "3 times the steps", 0, [60.0, 90.0, 98.0], 0.019),
]


def test_a_row_has_mean_and_spread_over_its_seeds() -> None:
    figures = statistics(LINES[:2])
    assert figures["seeds"] == 2
    assert figures["edited_within_percent"]["mean"] == [42.0, 80.0, 91.0]
    assert figures["edited_within_percent"]["sd"] == pytest.approx([8**0.5, 0.0, 2**0.5])
    assert figures["real_distance_median"]["mean"] == pytest.approx(0.021)
    assert statistics(LINES[2:3])["real_distance_median"]["sd"] == 0.0


def test_runs_are_put_into_tables_by_their_groups() -> None:
    found = summary(LINES)
    assert list(found) == ["losses", "losses_without_real", "variations"]
    assert list(found["losses"]) == ["L_sem", "L_sem + L_rec"]
    assert list(found["variations"]) == [
        "edits: cycle",
        "norm of L_sem: l1",
        "3 times the steps",
    ]
    assert list(summary(LINES[:2])) == ["losses"]


def test_the_papers_figures_stand_beside_its_rows() -> None:
    text = tables(LINES)
    assert "edited shapes, .01 / .02 / .03" in text
    assert (
        "| L_sem + L_rec | 2 | 42.0 ± 2.8 / 80.0 ± 0.0 / 91.0 ± 1.4 | 40.3 / 82.2 / 95.4 "
        "| 21.0 ± 1.4 / 40.0 ± 0.0 / 45.5 ± 0.7 | 0.0420 ± 0.0028 / 0.0210 ± 0.0014 |"
    ) in text
    assert "| L_sem | 1 | 30.0 / 70.0 / 80.0 | 35.2 / 72.3 / 87.2 " in text
    assert "15.0 / 35.0 / 40.0 | 0.0500 / 0.0250 |" in text
    # What the variations vary stands above them.
    varied = text[text.index("one thing changed") :]
    assert varied.index("multiply; norm of L_sem: l2 | 2 | 42.0") < varied.index("edits: cycle")
    assert "| norm of L_sem: l1 | 1 | 20.0 / 60.0 / 70.0 | - |" in varied


def test_the_settings_are_told() -> None:
    said = settings(LINES)
    assert said.startswith("7 runs of 9 steps of 16 clouds of 512 points, learning rate 0.001")
    assert "head the paper's, 0.7 hours together, CPU, threads: 1" in said


def test_the_command_line_prints_and_writes_figures_for_the_card(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    results, card = tmp_path / "ablation.jsonl", tmp_path / "ablation.json"
    results.write_text("".join(json.dumps(entry) + "\n" for entry in LINES), "utf-8")
    monkeypatch.setattr("sys.argv", ["report", str(results), "--json", str(card)])
    ablation_report.main()
    assert capsys.readouterr().out == f"{settings(LINES)}\n\n{tables(LINES)}\n"
    figures = json.loads(card.read_text("utf-8"))
    assert figures["thresholds"] == [0.01, 0.02, 0.03]
    assert figures["paper"]["L_rec"] == [11.9, 47.9, 77.6]
    assert figures["rows"] == summary(LINES)


def test_no_results_end_the_command_with_a_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["report", str(tmp_path / "none.jsonl")])
    with pytest.raises(SystemExit) as end:
        ablation_report.main()
    assert end.value.code == 1
    assert "there are no results in" in capsys.readouterr().err
