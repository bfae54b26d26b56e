"""What came of a run, on one page: ``python -m model_export.report table --models models``.

Export writes it beside the run: `report.md` with the figures, `report.png` with the curves of
training and a sheet of fits.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib import pyplot
from matplotlib.axes import Axes

from model_export.config import SHIPPED
from model_export.contact_sheet import fit_panel
from model_export.pictures import BLUE, YELLOW, Panel, draw, view
from model_export.realistic import RealisticShape, find_shapes
from model_export.samples import synthetic_samples
from service.encode.estimate import estimate
from service.encode.model import Model, load_models

FITS = 10
"""Shapes drawn on the sheet."""
COLUMNS = 5
ROWS = {
    "constant": "always the mean (to compare with)",
    "encoder": "encoder alone",
    "refined": "with refinement",
}


def write_report(folder: Path, model: Model, shapes: Sequence[RealisticShape]) -> Path:
    """Write a run's `report.md` and `report.png`.

    Args:
        folder: of the run, with its `log.jsonl`.
        model: that was exported from it, with its metrics in the card.
        shapes: real ones, of which held-out ones are drawn; without any, fresh draws are.

    Returns:
        The path of `report.md`.
    """
    log = _read_log(folder / "log.jsonl")
    held_out = [shape for shape in shapes if shape.held_out][:FITS]
    panels = [fit_panel(model, shape) for shape in held_out] or drawn_panels(model, FITS)
    draw_report(log, panels, folder / "report.png")
    path = folder / "report.md"
    path.write_text(describe(model, log, bool(held_out)), "utf-8")
    return path


def _read_log(path: Path) -> list[dict[str, Any]]:
    if not path.is_file():
        return []
    return [json.loads(line) for line in path.read_text("utf-8").splitlines()]


def drawn_panels(model: Model, count: int) -> list[Panel]:
    """Fresh template shapes with the fits to their samples drawn over them."""
    size = len(model.template.parameters)
    panels = []
    for number, (drawn, label, variant) in enumerate(
        zip(*synthetic_samples(model, count), strict=True), 1
    ):
        fit, own = estimate(model, drawn), model.template.variants[variant]
        true = own.decode(label[:size]) + label[size:]
        fitted = fit.template.decode(fit.parameters) + fit.translation
        title = f"draw {number}\n{fit.distance:.4f} (encoder {fit.encoder_distance:.4f})"
        meshes = [
            (true, own.faces[~own.hidden], YELLOW, 1.0),
            (fitted, fit.template.faces[~fit.template.hidden], BLUE, 0.25),
        ]
        panels.append(Panel(title, meshes))
    return panels


def draw_report(log: Sequence[dict[str, Any]], panels: Sequence[Panel], path: Path) -> None:
    """Write the curves of a log and the panels below them as one PNG."""
    rows = -(-len(panels) // COLUMNS)
    figure = pyplot.figure(figsize=(11, 3.2 + 2.2 * rows), layout="constrained")
    above, below = figure.subfigures(2, 1, height_ratios=[3.2, 2.2 * rows])
    losses, shares = above.subplots(1, 2)
    _draw_losses(losses, log)
    _draw_shares(shares, log)
    grid = below.subplots(rows, COLUMNS, squeeze=False)
    for axes in grid.flat:
        axes.axis("off")
    for axes, panel in zip(grid.flat, panels, strict=False):
        draw(axes, panel, view())
    figure.savefig(path, dpi=80)
    pyplot.close(figure)


def _draw_losses(axes: Axes, log: Sequence[dict[str, Any]]) -> None:
    steps = [line["step"] for line in log]
    names = [name for name in ("loss", "sem", "rec", "sem_edit", "rec_edit", "sim")
             if log and name in log[-1]]  # fmt: skip
    for name in names:
        axes.plot(steps, [line[name] for line in log], label=name, lw=2 if name == "loss" else 1)
    axes.set(title="losses (running means)", xlabel="step", yscale="log")
    if names:
        axes.legend(fontsize=7)


def _draw_shares(axes: Axes, log: Sequence[dict[str, Any]]) -> None:
    steps = [line["step"] for line in log]
    for place, threshold in enumerate((".01", ".02", ".03")):
        shares = [100 * line["within"][place] for line in log]
        axes.plot(steps, shares, label=f"within {threshold}")
    axes.set(title="encoder alone: % of vertices", xlabel="step", ylim=(0, 100))
    axes.legend(fontsize=7, loc="lower right")


def describe(model: Model, log: Sequence[dict[str, Any]], real: bool) -> str:
    """The report as Markdown.

    Args:
        model: with its metrics in the card.
        log: of the run.
        real: whether the sheet shows real shapes.
    """
    card = model.card
    training, table = card["training"], card["metrics"]["synthetic"]
    data = card["data"]["realistic"]
    lines = [
        f"# {card['label']}: {card['name']} {card['version']}",
        "",
        f"{sum(run['steps'] for run in training['runs'])} steps in {training['hours']} hours; "
        f"{data['train']} real shapes to train on, {data['test']} held out.",
        "",
        "![Curves and fits](report.png)",
        "",
        f"Yellow: {'held-out real' if real else 'fresh template'} shapes. Blue: the fitted "
        "template. Above each its distance over the shape's diagonal.",
        "",
        f"Share of template vertices within .01/.02/.03 of their place (radius 0.6), in %, over "
        f"{table['shapes']} fresh template shapes:",
        "",
        "| | within .01 | .02 | .03 | after an edit .01 | .02 | .03 |",
        "|---|---|---|---|---|---|---|",
    ]
    for row, words in ROWS.items():
        shares = table[row]["vertices_within_percent"] + table[row]["edited_within_percent"]
        lines.append(f"| {words} | " + " | ".join(f"{share:.1f}" for share in shares) + " |")
    lines += ["", "Mean error of each parameter, in % of its range:", ""]
    lines += [f"| parameter | {' | '.join(ROWS.values())} |", "|---|---|---|---|"]
    for name in model.template.names:
        cells = (f"{table[row]['mean_error_percent_of_range'][name]:.1f}" for row in ROWS)
        lines.append(f"| `{name}` | {' | '.join(cells)} |")
    if log:
        lines += ["", f"Last loss: {log[-1]['loss']:.4g}, at step {log[-1]['step']}."]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.report", description=__doc__)
    parser.add_argument("name", help="of the run and of the category")
    parser.add_argument("--run", type=Path, help="its folder (default runs/<name>)")
    parser.add_argument("--models", type=Path, default=SHIPPED, help="folder of its exported model")
    parser.add_argument("--realistic", type=Path, help="folder of real meshes to draw fits of")
    arguments = parser.parse_args()
    model = load_models(arguments.models)[arguments.name]
    shapes = find_shapes(arguments.realistic) if arguments.realistic else []
    print(f"wrote {write_report(arguments.run or Path('runs') / arguments.name, model, shapes)}")


if __name__ == "__main__":
    main()
