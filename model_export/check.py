"""Check a template and draw it: ``python -m model_export.check table.yaml --out sheet.png``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh
import yaml
from matplotlib import pyplot
from matplotlib.axes import Axes
from numpy.typing import NDArray

from model_export.entries import find_entry_mistakes
from model_export.mistakes import Mistake, draws, find_mistakes
from model_export.pictures import BLUE, GREY, YELLOW, Panel, draw, view
from service.template.affine import AffineTemplate
from service.template.loader import TemplateError, compile_template

Array = NDArray[np.float64]

PAIRS = 3
"""Parameters a row of the sheet, each with its two extremes."""


def check(path: Path) -> tuple[AffineTemplate | None, list[Mistake]]:
    """Read a template file and look for mistakes.

    Args:
        path: of the YAML file.

    Returns:
        The template, or None where it can't be compiled; and the mistakes.
    """
    try:
        spec = yaml.safe_load(path.read_text("utf-8"))
    except (OSError, UnicodeError, yaml.YAMLError) as error:
        return None, [Mistake("the file", f"can't be read: {error}")]
    if found := find_entry_mistakes(spec):
        return None, found
    try:
        template = compile_template(spec)
    except TemplateError as error:
        return None, [Mistake("the file", str(error))]
    return template, find_mistakes(template)


def draw_sheet(template: AffineTemplate, path: Path) -> None:
    """Write the rest shape, its variants, each parameter's two extremes and the table of parameters
    as one PNG.

    The rest shape is the middle of the shapes that keep the relations.  An extreme that breaks a
    relation is drawn nevertheless and says so.
    """
    rest = draws(template)[0]
    usual, *others = template.variants
    panels = [Panel(own.variant, [_mesh(own, rest, YELLOW)]) for own in others]
    panels += [panel for index in range(len(rest)) for panel in _extremes(template, rest, index)]
    rows = -(-len(panels) // (2 * PAIRS))
    top = max(3.0, 0.6 + 0.2 * len(rest))
    figure = pyplot.figure(figsize=(11, top + 2.0 * rows), layout="constrained")
    above, below = figure.subfigures(2, 1, height_ratios=[top, 2.0 * rows])
    picture, table = above.subplots(1, 2, width_ratios=[1, 2.2])
    draw(picture, Panel(f"{template.label} at rest", [_mesh(usual, rest, YELLOW)]), view())
    _draw_table(table, template, rest)
    grid = below.subplots(rows, 2 * PAIRS, squeeze=False)
    for axes in grid.flat:
        axes.axis("off")
    for axes, panel in zip(grid.flat, panels, strict=False):
        draw(axes, panel, view())
    figure.savefig(path, dpi=80)
    pyplot.close(figure)


def _mesh(
    template: AffineTemplate, f: Array, colour: tuple[float, float, float]
) -> tuple[Array, NDArray[np.int64], tuple[float, float, float], float]:
    return template.decode(f), template.faces[~template.hidden], colour, 1.0


def _extremes(template: AffineTemplate, rest: Array, index: int) -> list[Panel]:
    parameter = template.parameters[index]
    own = next((own for own in template.variants if own.active[index]), template)
    panels = []
    for value, colour in ((parameter.low, GREY), (parameter.high, BLUE)):
        f = rest.copy()
        f[index] = value
        title = f"{parameter.name} = {value:g}"
        if template.broken_relations(f):
            title += "\n(breaks a relation)"
        panels.append(Panel(title, [_mesh(own, f, colour)]))
    return panels


def _draw_table(axes: Axes, template: AffineTemplate, rest: Array) -> None:
    cells = [
        [p.name, f"{p.low:g} - {p.high:g}", "{:g} - {:g}".format(*p.typical), f"{value:.3g}"]
        for p, value in zip(template.parameters, rest, strict=True)
    ]
    head = ["parameter", "range in m", "typical", "at rest"]
    axes.axis("off")
    table = axes.table(cellText=cells, colLabels=head, loc="center", cellLoc="left")
    table.auto_set_font_size(False)
    table.set_fontsize(8)
    table.auto_set_column_width(list(range(len(head))))


def rest_mesh(template: AffineTemplate) -> trimesh.Trimesh:
    """The rest shape as a mesh in metres, standing on y = 0."""
    usual = template.variants[0]
    vertices = usual.decode(draws(template)[0])
    vertices = vertices - [0.0, vertices[:, 1].min(), 0.0]
    return trimesh.Trimesh(vertices, usual.faces, process=False)


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; the exit status is 1 when the template has an error."""
    parser = argparse.ArgumentParser(prog="python -m model_export.check", description=__doc__)
    parser.add_argument("file", type=Path, help="template file")
    parser.add_argument("--out", type=Path, help="PNG to draw it to")
    parser.add_argument("--mesh", type=Path, help="write the rest shape here, to try requests with")
    given = parser.parse_args(arguments)
    template, mistakes = check(given.file)
    for mistake in mistakes:
        print(mistake)
    if any(mistake.error for mistake in mistakes) or template is None:
        return 1
    print(
        f"{given.file} is sound: {len(template.names)} parameters, {len(template.parts)} parts, "
        f"{len(template.base)} vertices for clouds of {template.points} points"
    )
    if given.out:
        draw_sheet(template, given.out)
        print(f"wrote {given.out}")
    if given.mesh:
        rest_mesh(template).export(given.mesh)
        print(f"wrote {given.mesh}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
