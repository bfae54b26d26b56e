from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from model_export.benchmark import __main__ as command
from model_export.benchmark import inputs
from model_export.benchmark.case import Case
from model_export.benchmark.inputs import DETAILED, detailed_case, template_cases
from model_export.benchmark.kept import Kept
from model_export.benchmark.known import Known, told, wrong_by
from model_export.benchmark.outliers import OUTLIERS
from model_export.benchmark.report import Checks, write_report
from model_export.benchmark.robustness import Stand
from model_export.benchmark.robustness import table as stood
from model_export.benchmark.runner import Results, run_case, time_limit
from model_export.benchmark.score import Judge
from model_export.benchmark.service_checks import Identity
from model_export.benchmark.tables import TRUTH, mean, table, worst
from model_export.rivals.registry import RIVALS, Entry
from model_export.rivals.subject import Edit, Editor, Outcome, Subject
from service.encode.distance import Cloud, surface_distance
from service.mesh.surface import Normalization, sample_surface
from service.template.loader import load_template


def exact(model: Any, vertices: np.ndarray, faces: np.ndarray) -> Known:
    """In the place of inference: the middle of every range."""
    f = (model.template.low + model.template.high) / 2
    return Known(model.template.variants[0], f, np.zeros(3))


@pytest.fixture(scope="module")
def chair() -> Case:
    model: Any = SimpleNamespace(template=load_template("chair"), name="chair")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(inputs, "inferred", exact)
        return detailed_case(model, DETAILED["chair"](1, 1), 1)


def broken(subject: Subject) -> Editor:
    raise RuntimeError("precomputation failed")


def endless(subject: Subject) -> Editor:
    def edit(change: Edit) -> Outcome:
        return Outcome(np.full_like(subject.vertices, np.nan))

    return edit


def run(chair: Case, path: Path, **rivals: Entry) -> list[dict[str, Any]]:
    results = Results(path)
    run_case(chair, 0, rivals, results, lambda text: None)
    return results.rows


@pytest.mark.parametrize("name", DETAILED)
@pytest.mark.parametrize("seed", [0, 2, 3, 7])
def test_the_truth_lays_the_template_over_the_shape(name: str, seed: int) -> None:
    shape, category = DETAILED[name](seed, 2), load_template(name)
    frame = Normalization.of(shape.mesh(shape.parameters))
    count = len(shape.names)
    known = told(shape, category, frame, np.ones(count))
    assert known.template.variant == shape.variant
    vertices = frame.apply(shape.mesh(shape.parameters))
    samples = sample_surface(vertices, shape.faces, 2000, np.random.default_rng(0))
    cloud = Cloud(samples.points, samples.normals)
    wrong = told(shape, category, frame, 1.0 + 0.2 * (-1.0) ** np.arange(count))
    near, far = (surface_distance(k.template, k.f, k.t, cloud) for k in (known, wrong))
    assert near < 0.02
    assert near < far


def test_parameters_are_wrong_by_as_much_as_is_said() -> None:
    factors = wrong_by(0.05, 3, 8)
    np.testing.assert_allclose(np.abs(factors - 1.0), 0.05)
    assert not np.array_equal(factors, wrong_by(0.05, 4, 8))


def test_each_parameter_is_edited_by_each_factor(chair: Case) -> None:
    edits = list(chair.edits("true"))
    assert len(edits) == 16
    assert all(edit.truth is not None for edit in edits)
    assert all(np.count_nonzero(edit.df) == 1 for edit in edits)


def test_the_template_follows_itself() -> None:
    model: Any = SimpleNamespace(template=load_template("airplane"), name="airplane")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(inputs, "inferred", exact)
        case = next(iter(template_cases(model, 1)))
    judge, editor = Judge(case), RIVALS["paper, k = 1"].rule(case.subject("true"))
    for edit in case.edits("true"):
        score = judge.score(edit, editor(edit))
        assert score.accuracy == pytest.approx(0.0, abs=1e-4)
        assert score.passed


def test_the_truth_passes_and_doing_nothing_does_not(chair: Case) -> None:
    judge = Judge(chair)
    edit = next(iter(chair.edits("true")))
    assert edit.truth is not None
    perfect = judge.score(edit, Outcome(edit.truth))
    assert (perfect.accuracy, perfect.locality, perfect.flips, perfect.gap) == (0, 0, 0, 0)
    assert perfect.passed
    idle = judge.score(edit, Outcome(chair.vertices))
    assert idle.accuracy == pytest.approx(1.0)
    assert not idle.near
    looked = [judge.score(own, Outcome(own.truth)).crossings for own in chair.edits("true")
              if own.truth is not None]  # fmt: skip
    assert sorted(looked, key=str) == [0.0] * 4 + [None] * 12
    with pytest.raises(ValueError, match="vertices"):
        judge.score(edit, Outcome(chair.vertices[1:]))


def test_a_failure_is_written_down_and_the_run_goes_on(chair: Case, tmp_path: Path) -> None:
    rows = run(
        chair, tmp_path / "r.jsonl",
        broken=Entry(broken), endless=Entry(endless), blend=RIVALS["blend"],
    )  # fmt: skip
    assert len(rows) == 9
    own = {row["rival"]: row for row in rows if row["known"] == "true"}
    assert own["broken"]["failure"] == "RuntimeError: precomputation failed"
    assert "finite" in own["endless"]["failure"]
    assert own["blend"]["failure"] is None
    assert len(own["blend"]["scores"]) == 16
    assert mean([own["broken"]], "passed") == 0.0
    text = table(rows, TRUTH)
    assert "3 of 3: RuntimeError: precomputation failed" in text
    assert "| chair 1 |" in worst(rows, "blend", "true")


def crash(subject: Subject) -> Editor:
    os._exit(7)


def test_a_library_that_crashes_does_not_take_the_run_with_it(chair: Case, tmp_path: Path) -> None:
    rows = run(
        chair, tmp_path / "r.jsonl",
        crash=Entry(crash, apart=True), blend=Entry(RIVALS["blend"].rule, apart=True),
    )  # fmt: skip
    own = {row["rival"]: row for row in rows if row["known"] == "true"}
    assert own["crash"]["failure"] == "crashed: exit code 7"
    assert own["crash"]["edits"] == len(own["blend"]["scores"]) == 16
    assert own["blend"]["failure"] is None


def test_what_takes_too_long_is_stopped() -> None:
    with pytest.raises(TimeoutError, match="longer than"), time_limit(0.05):
        time.sleep(5.0)
    with time_limit(10.0):
        pass


def test_a_run_goes_on_where_it_was_cut_off(chair: Case, tmp_path: Path) -> None:
    path = tmp_path / "r.jsonl"
    run(chair, path, blend=RIVALS["blend"])
    lines = path.read_text().splitlines()
    path.write_text("\n".join([lines[0], lines[1][:20]]) + "\n")
    said: list[str] = []
    results = Results(path)
    run_case(chair, 0, {"blend": RIVALS["blend"]}, results, said.append)
    assert said == ["D chair 1: blend, off", "D chair 1: blend, inferred"]
    assert [row["known"] for row in results.rows] == ["true", "off", "inferred"]


def test_blending_beats_the_rest_with_the_true_parameters(chair: Case, tmp_path: Path) -> None:
    rivals = {
        name: RIVALS[name] for name in ("blend", "global scale", "nine-slice", "cage (bound)")
    }
    rows = run(chair, tmp_path / "r.jsonl", **rivals)
    accuracy = {
        row["rival"]: mean([row], "accuracy") for row in rows if row["known"] in ("true", "truth")
    }
    assert accuracy["blend"] < 0.1
    assert min(accuracy, key=lambda name: accuracy[name] or 0.0) == "blend"


@pytest.mark.parametrize("name", OUTLIERS)
def test_unlike_shapes_are_meshes(name: str) -> None:
    vertices, faces = OUTLIERS[name][1]()
    assert np.isfinite(vertices).all()
    assert faces.max() < len(vertices)
    assert len(faces) > 1000


def test_the_command_writes_a_page_of_all_sources(
    chair: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    checks = Checks([Identity(True, 8, 8, 0.01)], [0.001], {"seat_width": (1.0, 0.99)})
    monkeypatch.setattr(command, "cases", lambda *_: [(0, chair)])
    monkeypatch.setattr(command, "check", lambda *_: checks)
    monkeypatch.setattr(command, "draw", lambda *_: None)
    stand = Stand("D", "chair", "holes", recognised=True, upright=True, drift=(0.02,))
    monkeypatch.setattr(command, "recover", lambda *_: "| S, 2 chairs | constant |")
    monkeypatch.setattr(command, "body_section", lambda *_: "Bodies stand.")
    monkeypatch.setattr(command, "robust", lambda *_: stood([stand]))
    monkeypatch.setattr(command, "CATEGORIES", ("chair",))
    monkeypatch.setattr(sys, "argv", ["benchmark", "--out", str(tmp_path), "--rival", "blend"])
    command.main()
    page = (tmp_path / "report.md").read_text()
    assert "## D, chairs" in page
    assert "| blend |" in page
    assert "| chair | 1 of 1 | 8 of 8 |" in page
    assert "Bodies stand." in page
    assert "| S, 2 chairs | constant |" in page
    assert "| D, chairs | holes | 1 | 100.0 |" in page
    rows = [json.loads(line) for line in (tmp_path / "results.jsonl").read_text().splitlines()]
    assert [row["known"] for row in rows] == ["true", "off", "inferred"]


def test_what_is_kept_is_not_made_again(tmp_path: Path) -> None:
    path = tmp_path / "kept.jsonl"
    assert Kept(path).get("one", lambda: "first") == "first"
    assert Kept(path).get("two", lambda: "second") == "second"
    path.write_text(path.read_text()[:-5])
    again = Kept(path)
    assert again.get("one", lambda: "other") == "first"
    assert again.get("two", lambda: "other") == "other"


def test_a_page_has_tables_without_truth_for_real_shapes(chair: Case, tmp_path: Path) -> None:
    real = Case("R", "one", chair.category, chair.vertices, chair.faces,
                {"inferred": chair.known["true"]})  # fmt: skip
    rows = run(real, tmp_path / "r.jsonl", blend=RIVALS["blend"], cage=RIVALS["cage (bound)"])
    assert {row["rival"] for row in rows} == {"blend"}
    assert rows[0]["scores"][0]["detail"] is not None
    checks = Checks([Identity(True, 1, 1, 0.0)], [0.0], {"seat_width": (1.0, 1.0)})
    write_report(rows, {"chair": checks}, {"More": "said."}, tmp_path / "report.md")
    page = (tmp_path / "report.md").read_text()
    assert "Laplacian change" in page
    assert "## More\n\nsaid.\n" in page
