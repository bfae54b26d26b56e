"""Draws of edits."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from service.augment.affinesampler import AffineSampler, overall_size
from service.augment.bodysampler import FARTHEST_TURN, BodySampler
from service.augment.draw import FARTHEST, Draw
from service.augment.sampling import chance
from service.augment.variants import Source
from service.template.anatomy import JOINTS, limits
from service.template.skinned import NAMES, Body


def draws(sampler: AffineSampler | BodySampler, count: int, strength: float = 1.0) -> list[Draw]:
    return [sampler.draw(chance(1, "sha256-ab", index, 0), strength) for index in range(count)]


def test_lengths_stay_within_bounds_and_differ_in_kind(chair_source: Source) -> None:
    found = chair_source.found
    sampler, before = (
        AffineSampler(found),
        dict(zip(found.model.template.names, found.parameters, strict=True)),
    )
    made = draws(sampler, 60)
    for draw in made:
        for name, change in draw.edits.items():
            assert 1 / FARTHEST - 1e-5 <= change.amount / before[name] <= FARTHEST + 1e-5
    kinds = {tuple(draw.edits) for draw in made}
    assert len(kinds) > 5
    assert all(draw.edits for draw in made)
    assert sampler.real


def test_idle_and_nuisance_parameters_are_left_alone(chair_source: Source) -> None:
    template = chair_source.found.fit.template
    offered = {
        name
        for name, seen, moves in zip(template.names, template.public, template.active, strict=True)
        if seen and moves
    }
    assert {
        name for draw in draws(AffineSampler(chair_source.found), 30) for name in draw.edits
    } == offered


def test_a_chair_of_no_usual_size_keeps_it(chair_source: Source) -> None:
    found = chair_source.found
    giant = SimpleNamespace(
        fit=found.fit,
        parameters=100 * found.parameters,
        unit="m",
        scale=found.scale / 100,
        model=found.model,
    )
    size = overall_size(found.fit.template, giant.parameters)
    sampler, sizes = AffineSampler(giant), []
    for index in range(40):
        goal = sampler._goal(chance(0, "sha256-1", index, 0))
        sizes.append(overall_size(found.fit.template, goal) / size)
    assert 0.75 < np.median(sizes) < 1.3


def test_without_a_distribution_lengths_are_drawn_within_what_is_typical(
    chair_source: Source,
) -> None:
    found = chair_source.found
    card = {key: value for key, value in found.model.card.items() if key != "distribution"}
    plain = SimpleNamespace(
        fit=found.fit, parameters=found.parameters, unit=found.unit, scale=found.scale,
        model=SimpleNamespace(card=card),
    )  # fmt: skip
    sampler = AffineSampler(plain)
    assert not sampler.real
    template = found.fit.template
    for index in range(20):
        goal = sampler._goal(chance(0, "sha256-1", index, 0))
        assert not template.broken_relations(goal)
        shares = goal[template.public] / goal[template.public].max()
        assert (shares > 0).all()


@pytest.fixture(scope="module")
def sitter(strider: Body) -> SimpleNamespace:
    """A body as it is found, of a model that knows no real poses."""
    model = SimpleNamespace(card={})
    return SimpleNamespace(
        fit=SimpleNamespace(body=strider), parameters=strider.parameters, model=model
    )


def test_joints_turn_a_little_within_their_reach(sitter: SimpleNamespace) -> None:
    before, (low, high) = sitter.parameters, limits()
    low, high = np.minimum(low.ravel(), before[:72]), np.maximum(high.ravel(), before[:72])
    for draw in draws(BodySampler(sitter), 30):
        assert not {f"global_orient_{axis}" for axis in "xyz"} & set(draw.edits)
        for name, change in draw.edits.items():
            index = NAMES.index(name)
            if index < 72:
                assert low[index] <= change.amount <= high[index]
    assert 0 < FARTHEST_TURN < 1


def test_whole_limbs_turn_or_stay(sitter: SimpleNamespace) -> None:
    made = draws(BodySampler(sitter), 30)
    for draw in made:
        joints = {name[:-2] for name in draw.edits if name[:-2] in JOINTS}
        for side in ("left", "right"):
            assert (f"{side}_knee" in joints) == (f"{side}_hip" in joints)
    assert len({tuple(draw.edits) for draw in made}) > 5


def test_chance_is_another_for_each_seed_file_index_and_attempt() -> None:
    firsts = {
        chance(seed, f"sha256-{mesh}", index, attempt).random()
        for seed in (0, 1)
        for mesh in ("ab", "cd")
        for index in (0, 1)
        for attempt in (0, 1)
    }
    assert len(firsts) == 16
