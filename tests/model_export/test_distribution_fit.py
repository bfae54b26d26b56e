"""Distributions of real shapes, fitted and written."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from model_export.distribution import (
    FEWEST,
    Fitted,
    copula,
    correlation,
    distribution_entry,
    factors,
    mirrored,
    scores,
    write_entry,
)
from model_export.realistic import RealisticShape
from service.augment.distribution import ALL, OVERALL_SIZE
from service.encode.card import DistributionEntry
from service.encode.model import SHIPPED
from service.template.skinned import NAMES

NAMED = ("width", "height")
MODEL = SimpleNamespace(
    kind="affine", template=SimpleNamespace(names=NAMED, public=np.array([True, True]))
)


def fitted(count: int, kind: str = "chair", sized: int | None = None) -> list[Fitted]:
    """Shapes whose height follows their width; sizes of some are known."""
    rng = np.random.default_rng(count)
    width = rng.normal(size=count)
    size = np.where(np.arange(count) < (count if sized is None else sized), 0.1, np.nan)
    values = np.stack([width, 2 * width + 0.1 * rng.normal(size=count), size], axis=1)
    shape = RealisticShape("a", Path("a.ply"), False, {"licence": "CC0-1.0"})
    return [Fitted(shape, kind, row) for row in values]


def test_an_entry_tells_of_shapes_and_how_they_vary() -> None:
    entry = distribution_entry(MODEL, fitted(40))
    DistributionEntry.model_validate(entry)
    assert entry["parameters"] == [*NAMED, OVERALL_SIZE]
    assert set(entry["kinds"]) == {ALL, "chair"}
    assert entry["source"] == {
        "shapes": 40, "split": "train", "kinds": {"chair": 40}, "licences": {"CC0-1.0": 40},
    }  # fmt: skip
    loadings = np.array(entry["kinds"][ALL]["loadings"])
    assert loadings[:, 0] @ loadings[:, 1] > 0.9


def test_few_of_a_kind_are_told_among_all() -> None:
    entry = distribution_entry(MODEL, fitted(30) + fitted(FEWEST - 1, "stool"))
    assert set(entry["kinds"]) == {ALL, "chair"}
    with pytest.raises(ValueError, match="too few"):
        distribution_entry(MODEL, fitted(FEWEST - 1))


def test_sizes_that_few_have_are_those_of_all_or_left_out() -> None:
    both = fitted(30) + fitted(20, "stool", sized=2)
    entry = distribution_entry(MODEL, both)
    stool = entry["kinds"]["stool"]
    assert stool["quantiles"][2] == entry["kinds"][ALL]["quantiles"][2]
    assert not np.array(stool["loadings"])[:, 2].any()
    assert OVERALL_SIZE not in distribution_entry(MODEL, fitted(30, sized=3))["parameters"]


def test_correlations_of_few_samples_shrink() -> None:
    rng = np.random.default_rng(0)
    few, many = (correlation(scores(rng.normal(size=(n, 5))), n) for n in (20, 20_000))
    off = ~np.eye(5, dtype=bool)
    assert np.abs(few[off]).max() < 0.2
    assert np.abs(many[off]).max() < 0.05
    np.testing.assert_array_equal(np.diag(few), 1.0)


def test_factors_are_no_longer_than_one_and_enough_of_them_are_the_correlation() -> None:
    r = np.array([[1.0, 0.6, 0.2], [0.6, 1.0, -0.1], [0.2, -0.1, 1.0]])
    whole = factors(r, 3)
    np.testing.assert_allclose(whole.T @ whole, r, atol=1e-12)
    assert (np.linalg.norm(factors(r, 1), axis=0) <= 1.0).all()


def test_quantiles_leave_the_outermost_out() -> None:
    values = np.linspace(0, 1, 1001)[:, None]
    (row,) = copula(values, 5, 1)["quantiles"]
    np.testing.assert_allclose(row, [0.02, 0.26, 0.5, 0.74, 0.98], atol=1e-3)


def test_a_mirrored_pose_twice_is_the_pose() -> None:
    poses = np.random.default_rng(0).normal(size=(3, 69))
    np.testing.assert_array_equal(mirrored(mirrored(poses)), poses)
    pose = np.zeros((1, 69))
    pose[0, NAMES.index("left_elbow_y") - 3] = 0.5
    assert mirrored(pose)[0, NAMES.index("right_elbow_y") - 3] == -0.5


def test_an_entry_is_put_into_a_card_and_nothing_else_changes(tmp_path: Path) -> None:
    path = tmp_path / "chair.json"
    shutil.copyfile(SHIPPED / "chair.json", path)
    before = json.loads(path.read_text("utf-8"))
    entry = distribution_entry(MODEL, fitted(40))
    write_entry(path, entry)
    after = json.loads(path.read_text("utf-8"))
    assert after.pop("distribution") == entry
    before.pop("distribution")
    assert after == before
