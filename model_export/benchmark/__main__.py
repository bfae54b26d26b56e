"""Every rival on the same inputs: ``python -m model_export.benchmark --out DIR``.

Writes `report.md` and `rivals.png`, and keeps `results.jsonl` and `sections.jsonl`: a run that is
cut off goes on where it was.  Name another folder to begin anew.  As-rigid-as-possible and
re-synthesis need the extra `benchmark`.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from model_export.benchmark.bodysection import body_section
from model_export.benchmark.case import Case
from model_export.benchmark.inference import (
    detailed_shapes,
    inference_section,
    recovery_table,
    template_shapes,
)
from model_export.benchmark.inputs import (
    DETAILED,
    detailed_case,
    detailed_cases,
    real_cases,
    template_cases,
)
from model_export.benchmark.kept import Kept
from model_export.benchmark.outliers import outlier_cases
from model_export.benchmark.report import Checks, write_report
from model_export.benchmark.robustness import Stand, robustness_section, stands, table
from model_export.benchmark.runner import Results, run_case
from model_export.benchmark.service_checks import continuity, identity, mirrored_parameters
from model_export.benchmark.sheet import draw_rivals
from model_export.config import SHIPPED
from model_export.rivals.registry import RIVALS, Entry
from service.encode.affinemodel import AffineModel
from service.encode.model import Model, load_models

CATEGORIES = ("chair", "airplane")
DRAWN = {
    "chair": ((0, "seat_depth", 1.4), (2, "leg_width", 1.4)),
    "airplane": ((15, "wing_length", 1.4), (5, "fuselage_width", 1.4)),
}
"""Seeds, parameters and factors of the edits in the picture."""


@dataclass(frozen=True)
class Plan:
    """How much of each source.

    Attributes:
        detailed, templates, real: inputs of D, S and R, a category.
        density: how finely D is cut.
        sliders, checked: parameters and inputs that the whole service is asked about.
        robust: inputs of D, and of R, that are disturbed,
        turns: turned so many ways; and one a category has two million vertices, where `many`.
        bodies: synthetic ones.
        recovered: shapes of S, and of D, a category, that rivals infer the parameters of.
    """

    detailed: int
    templates: int
    real: int
    density: int | None
    sliders: int
    checked: int
    robust: int
    turns: int
    many: bool
    bodies: int
    recovered: tuple[int, int]


FULL = Plan(
    12,
    4,
    8,
    None,
    sliders=8,
    checked=3,
    robust=3,
    turns=24,
    many=True,
    bodies=12,
    recovered=(300, 50),
)
QUICK = Plan(
    2, 1, 2, 2, sliders=1, checked=1, robust=1, turns=4, many=False, bodies=2, recovered=(50, 4)
)


def cases(model: Model, plan: Plan, folder: Path | None) -> Iterator[tuple[int, Case]]:
    """All inputs of a category, numbered within their source."""
    sources: list[Iterable[Case]] = [
        detailed_cases(model, plan.detailed, plan.density),
        template_cases(model, plan.templates),
        outlier_cases(model),
    ]
    if folder is not None:
        sources.append(real_cases(model, folder, plan.real))
    for source in sources:
        yield from enumerate(source)


def check(model: Model, plan: Plan) -> Checks:
    """What is asked of the service as a whole."""
    some = list(detailed_cases(model, plan.checked, plan.density))
    names = [p.name for p in model.template.parameters if not p.nuisance][: plan.sliders]
    return Checks(
        identities=[identity(model, case) for case in some],
        mirrored=[mirrored_parameters(model, case) for case in some],
        sliders=continuity(model, some[0], names),
    )


def robust(models: Mapping[str, Model], name: str, plan: Plan, folder: Path | None) -> str:
    """B12: what the service makes of disturbed files, all categories being possible."""
    sources = [detailed_cases(models[name], plan.robust, plan.density)]
    if folder is not None:
        sources.append(real_cases(models[name], folder, plan.robust))
    found: list[Stand] = []
    for source in sources:
        for case in source:
            many = plan.many and not found
            mesh = case.vertices, case.faces
            found += stands(models, name, case.source, *mesh, plan.turns, many)
    return table(found)


def recover(model: Model, plan: Plan) -> str:
    """B1: what each way of inferring makes of shapes whose parameters are known."""
    assert isinstance(model, AffineModel)
    fresh, detailed = plan.recovered
    sources = template_shapes(model, fresh), detailed_shapes(model, detailed, 2)
    return recovery_table(model, sources)


def draw(models: dict[str, Model], rivals: dict[str, Entry], path: Path) -> None:
    """The edits of `DRAWN`."""
    wanted = []
    for name, edits in DRAWN.items():
        for seed, parameter, factor in edits:
            case = detailed_case(models[name], DETAILED[name](seed, 2), seed)
            wanted.append((case, parameter, factor))
    draw_rivals(wanted, rivals, path)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.benchmark", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument("--quick", action="store_true", help="a few inputs, without slow rivals")
    parser.add_argument("--chairs", type=Path, help="folder of real chairs")
    parser.add_argument("--airplanes", type=Path, help="folder of real airplanes")
    parser.add_argument("--humans", type=Path, help="folder of characters with known joints")
    parser.add_argument("--models", type=Path, default=SHIPPED, help="models folder")
    parser.add_argument("--rival", choices=RIVALS, action="append", help="these only")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    plan = QUICK if options.quick else FULL
    rivals = {
        name: entry
        for name, entry in RIVALS.items()
        if name in (options.rival or RIVALS) and not (options.quick and entry.slow)
    }
    began = time.monotonic()

    def say(text: str) -> None:
        print(f"{time.monotonic() - began:7.1f} s  {text}", file=sys.stderr)

    models = load_models(options.models)
    results = Results(options.out / "results.jsonl")
    folders = {"chair": options.chairs, "airplane": options.airplanes}
    rigid = {name: models[name] for name in CATEGORIES}
    kept = Kept(options.out / "sections.jsonl")
    checks, stood, recovered = {}, list[str](), list[str]()
    for name in CATEGORIES:
        for number, case in cases(models[name], plan, folders[name]):
            run_case(case, number, rivals, results, say)
        say(f"the service as a whole, {name}")
        checks[name] = check(models[name], plan)
        say(f"disturbed files, {name}")
        disturbed = partial(robust, rigid, name, plan, folders[name])
        stood.append(kept.get(f"disturbed, {name}", disturbed))
        say(f"inference, {name}")
        recovered.append(kept.get(f"inference, {name}", partial(recover, models[name], plan)))
    bodies = partial(body_section, models["human"], plan.bodies, options.humans, say)
    sections = {
        "Inference": inference_section(recovered),
        "Disturbed files": robustness_section(stood),
        "H: Bodies": kept.get("bodies", bodies),
    }
    say("pictures")
    draw(models, rivals, options.out / "rivals.png")
    write_report(results.rows, checks, sections, options.out / "report.md")
    say(f"wrote {options.out / 'report.md'}")


if __name__ == "__main__":
    main()
