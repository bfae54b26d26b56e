"""Draws like real shapes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from pydantic import ValidationError

from service.augment.distribution import OVERALL_SIZE, Distribution
from service.encode.card import DistributionEntry, KindEntry
from service.encode.model import SHIPPED, Model, load_models

STRAIGHT = KindEntry(quantiles=[[0.0, 1.0], [10.0, 20.0]], loadings=[[1.0, -1.0]])
LOOSE = KindEntry(quantiles=[[5.0, 6.0], [5.0, 6.0]], loadings=[[0.0, 0.0]])


def drawn(distribution: Distribution, kind: str = "", count: int = 2000) -> np.ndarray:
    rng = np.random.default_rng(0)
    return np.array([list(distribution.draw(rng, kind).values()) for _ in range(count)])


def test_values_have_their_quantiles_and_go_together_as_they_should() -> None:
    values = drawn(Distribution(("a", "b"), {"all": STRAIGHT}))
    np.testing.assert_allclose(
        np.quantile(values[:, 0], [0.1, 0.5, 0.9]), [0.1, 0.5, 0.9], atol=0.03
    )
    np.testing.assert_allclose(values[:, 1], 20.0 - 10.0 * values[:, 0], atol=1e-9)


def test_what_goes_with_nothing_is_drawn_by_itself() -> None:
    values = drawn(Distribution(("a", "b"), {"all": LOOSE}))
    assert abs(np.corrcoef(values.T)[0, 1]) < 0.1


def test_a_kind_of_its_own_is_drawn_from_and_another_is_as_all() -> None:
    distribution = Distribution(("a", "b"), {"all": STRAIGHT, "stool": LOOSE})
    assert drawn(distribution, "stool", 50).min() >= 5.0
    assert drawn(distribution, "armchair", 50)[:, 0].max() <= 1.0
    assert distribution.ends("b", "stool") == (5.0, 6.0)
    low, high = distribution.ends("c")
    assert low > high


@pytest.mark.parametrize("name", ["chair", "airplane", "human"])
def test_shipped_cards_have_one_and_say_what_it_is_of(name: str) -> None:
    model = load_models(SHIPPED, names=[name])[name]
    entry, distribution = model.card["distribution"], Distribution.of(model)
    assert entry["source"]["shapes"] >= 80
    assert sum(entry["source"]["licences"].values()) == entry["source"]["shapes"]
    assert distribution is not None
    values = distribution.draw(np.random.default_rng(0))
    assert set(values) <= {*_names(model), OVERALL_SIZE}


def _names(model: Model) -> list[str]:
    return [entry["name"] for entry in model.entries()]


def test_draws_of_chairs_are_within_what_real_ones_have(models: Mapping[str, Model]) -> None:
    distribution = Distribution.of(models["chair"])
    assert distribution is not None
    values = drawn(distribution, "chair", 500)
    for name, column in zip(distribution.names, values.T, strict=True):
        low, high = distribution.ends(name, "chair")
        assert low <= column.min() <= column.max() <= high


@pytest.mark.parametrize(
    "change",
    [
        {"kinds": {}},
        {"parameters": ["a"]},
        {"kinds": {"all": {"quantiles": [[0, 1], [0]], "loadings": [[1, 1]]}}},
        {"kinds": {"all": {"quantiles": [[0, 1], [0, 1]], "loadings": [[1]]}}},
        {"kinds": {"all": {"quantiles": [[0, "x"], [0, 1]], "loadings": [[1, 1]]}}},
    ],
)
def test_entries_that_make_no_sense_are_refused(change: dict[str, object]) -> None:
    sound = {"parameters": ["a", "b"], "kinds": {"all": STRAIGHT.model_dump()}}
    DistributionEntry.model_validate(sound)
    with pytest.raises(ValidationError):
        DistributionEntry.model_validate(sound | change)
