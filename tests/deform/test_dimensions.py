from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.constraints import Interval
from service.deform.bound import columns_of
from service.deform.demands import Unsatisfiable
from service.deform.dimensions import Dimensions
from service.deform.measured import Level
from service.deform.outcome import Outcome
from service.edits import Change, Kind
from service.errors import InvalidRequest
from service.template.loader import load_template

CHAIR = load_template("paper_chair")
VALUES = {
    "back_height": 0.40,
    "back_thickness": 0.04,
    "seat_thickness": 0.06,
    "seat_depth": 0.45,
    "seat_width": 0.48,
    "leg_height": 0.36,
    "leg_depth": 0.05,
    "leg_width": 0.05,
}
F = np.array([VALUES[name] for name in CHAIR.names])
EVERY = range(len(F))


def box_chair() -> Dimensions:
    """The template itself as the bound mesh: it moves exactly as its parameters say."""
    return Dimensions(CHAIR, F, CHAIR.decode(F), columns=columns_of(CHAIR.jacobian, EVERY))


def wings() -> tuple[np.ndarray, np.ndarray]:
    """Vertices and Jacobian of a chair with a headrest 10 cm above its back, and wings that stick
    out by 5 cm each.

    They move with the outermost vertices.
    """
    vertices, jacobian = CHAIR.decode(F), CHAIR.jacobian
    top = vertices[:, 1].argmax()
    left, right = vertices[:, 0].argmax(), vertices[:, 0].argmin()
    extra = vertices[[top, left, right]] + [[0, 0.1, 0], [0.05, 0, 0], [-0.05, 0, 0]]
    moving = np.concatenate([jacobian, jacobian[[top, left, right]]]).astype(np.float32)
    return np.concatenate([vertices, extra]), moving


def with_wings() -> Dimensions:
    vertices, jacobian = wings()
    return Dimensions(CHAIR, F, vertices, columns=columns_of(jacobian, EVERY))


def named(values: np.ndarray) -> dict[str, float]:
    return dict(zip(CHAIR.names, values.tolist(), strict=True))


def after(dimensions: Dimensions, **changes: tuple[Kind, float]) -> dict[str, float]:
    return named(
        dimensions.outcome({name: Change(*change) for name, change in changes.items()}).parameters
    )


@pytest.mark.parametrize("name", CHAIR.names)
def test_a_parameter_changes_alone(name: str) -> None:
    value = VALUES[name]
    changes: list[tuple[Kind, float, float]] = [
        ("set", 0.17, 0.17) if "leg" in name else ("set", 0.3, 0.3),
        ("add", 0.02, value + 0.02),
        ("scale", 1.5, 1.5 * value),
    ]
    for kind, amount, expected in changes:
        assert after(box_chair(), **{name: (kind, amount)}) == VALUES | {name: expected}


def test_no_change_leaves_every_bit() -> None:
    dimensions = with_wings()
    assert np.array_equal(dimensions.outcome({}).parameters, F)
    derived = dimensions.derived(F)
    same = {name: Change("set", value) for name, value in derived.items()}
    np.testing.assert_array_equal(dimensions.outcome(same).parameters, F)


def test_derived_dimensions_are_read_from_the_parameters_and_the_mesh() -> None:
    derived = box_chair().derived(F)
    assert derived == pytest.approx(
        {"seat_top_height": 0.42, "total_height": 0.82, "total_width": 0.48, "total_depth": 0.45}
    )
    derived = with_wings().derived(F)
    assert derived["total_height"] == pytest.approx(0.92)
    assert derived["total_width"] == pytest.approx(0.58)
    taller = F.copy()
    taller[CHAIR.names.index("back_height")] += 0.2
    assert with_wings().derived(taller)["total_height"] == pytest.approx(1.12)


def test_the_seats_height_is_reached_by_the_legs() -> None:
    values = after(box_chair(), seat_top_height=("set", 0.5))
    assert values == pytest.approx(VALUES | {"leg_height": 0.44})


def test_the_total_height_is_shared_in_proportion() -> None:
    values = after(box_chair(), total_height=("add", 0.19))
    growth = 1 + 0.19 / (0.40 + 0.36)
    assert values == pytest.approx(
        VALUES | {"leg_height": 0.36 * growth, "back_height": 0.40 * growth}
    )


@settings(deadline=None, max_examples=40)
@given(
    st.sampled_from(["seat_top_height", "total_height", "total_width", "total_depth"]),
    st.floats(0.6, 1.8),
)
def test_extents_are_exact_on_the_mesh_itself(name: str, factor: float) -> None:
    dimensions = with_wings()
    target = dimensions.derived(F)[name] * factor
    values = dimensions.outcome({name: Change("scale", factor)}).parameters
    vertices, jacobian = wings()
    moved = vertices + jacobian @ (values - F)
    measured = {
        "seat_top_height": values[CHAIR.names.index("leg_height")] + 0.06,
        "total_height": np.ptp(moved[:, 1]),
        "total_width": np.ptp(moved[:, 0]),
        "total_depth": np.ptp(moved[:, 2]),
    }
    assert measured[name] == pytest.approx(target, rel=1e-6)


def test_an_extent_whose_outermost_vertex_changes_is_still_exact() -> None:
    # A rigid ornament is outermost until the seat has grown past it.
    vertices = np.concatenate([CHAIR.decode(F), [[0.30, 0, 0], [-0.30, 0, 0]]])
    jacobian = np.concatenate([CHAIR.jacobian, np.zeros((2, 3, 8))])
    jacobian[-2, 0, CHAIR.names.index("seat_width")] = 0.1
    dimensions = Dimensions(CHAIR, F, vertices, columns=columns_of(jacobian, EVERY))
    values = dimensions.outcome({"total_width": Change("set", 0.9)}).parameters
    moved = vertices + jacobian @ (values - F)
    assert np.ptp(moved[:, 0]) == pytest.approx(0.9, rel=1e-6)


def test_parameters_that_are_named_are_not_moved_by_dimensions() -> None:
    values = after(box_chair(), total_height=("set", 1.0), leg_height=("set", 0.40))
    assert values == pytest.approx(VALUES | {"leg_height": 0.40, "back_height": 0.54})
    values = after(box_chair(), total_height=("set", 1.0), seat_top_height=("set", 0.5))
    assert values == pytest.approx(VALUES | {"leg_height": 0.44, "back_height": 0.50})


def test_the_order_of_the_changes_makes_no_difference() -> None:
    changes = {
        "total_height": Change("set", 1.0),
        "seat_top_height": Change("scale", 1.1),
        "seat_thickness": Change("add", 0.02),
    }
    forward = box_chair().outcome(changes).parameters
    backward = box_chair().outcome(dict(reversed(changes.items()))).parameters
    np.testing.assert_array_equal(forward, backward)
    assert named(forward)["leg_height"] == pytest.approx(1.1 * 0.42 - 0.08)


def test_derived_changes_start_from_the_values_before_the_edit() -> None:
    values = after(box_chair(), seat_thickness=("set", 0.10), seat_top_height=("add", 0.05))
    assert values["leg_height"] + values["seat_thickness"] == pytest.approx(0.42 + 0.05)


@pytest.mark.parametrize(
    "changes",
    [
        {"total_height": 1.0, "leg_height": 0.4, "back_height": 0.4},
        {"seat_top_height": 0.5, "leg_height": 0.4},
        {"total_width": 0.5, "seat_width": 0.6},
        {"total_depth": 0.5, "seat_depth": 0.6},
    ],
)
def test_a_dimension_with_nothing_left_to_move_is_refused(changes: dict[str, float]) -> None:
    with pytest.raises(InvalidRequest) as caught:
        box_chair().outcome({name: Change("set", value) for name, value in changes.items()})
    assert caught.value.code == "dimension_fixed"
    assert next(iter(changes)) in caught.value.detail


def test_changes_that_agree_with_each_other_are_not_refused() -> None:
    values = after(box_chair(), seat_width=("set", 0.6), total_width=("set", 0.6))
    assert values == pytest.approx(VALUES | {"seat_width": 0.6})


SIZES = [
    ("seat_width", ("set", 1e-4), "0.8 * seat_width - 2 * leg_width >= 0"),
    ("leg_height", ("add", -0.3599), "leg_height > 0"),
    ("back_height", ("scale", 1e-6), "back_height > 0"),
    ("leg_width", ("set", 0.3), "0.8 * seat_width - 2 * leg_width >= 0"),
    ("seat_top_height", ("set", 0.05), "leg_height > 0"),
    ("total_height", ("set", 0.05), "back_height > 0"),
    ("total_width", ("set", 1e-4), "seat_width > 0"),
    ("total_depth", ("scale", 0.01), "0.8 * seat_depth - 2 * leg_depth >= 0"),
]


@pytest.mark.parametrize(("name", "change", "limit"), SIZES)
def test_what_breaks_a_limit_becomes_the_nearest_that_keeps_it(
    name: str, change: tuple[Kind, float], limit: str
) -> None:
    dimensions = box_chair()
    outcome = dimensions.outcome({name: Change(*change)})
    values = outcome.parameters
    assert limit in outcome.limits
    assert list(outcome.adjusted) == [name]
    asked, got = outcome.adjusted[name]
    now = named(values) | dimensions.derived(values)
    assert got == now[name]
    assert (got < asked) == (name == "leg_width")
    assert (values >= 1e-3 - 1e-12).all()
    assert (CHAIR.relations @ [1.0, *values] > -1e-12).all()
    moved = set(CHAIR.derived[name].by) if name in CHAIR.derived else {CHAIR.names.index(name)}
    assert {i for i, v in enumerate(values) if v != F[i]} <= moved


@pytest.mark.parametrize(("name", "change", "limit"), SIZES)
def test_when_strict_it_is_refused(name: str, change: tuple[Kind, float], limit: str) -> None:
    with pytest.raises(InvalidRequest) as caught:
        box_chair().outcome({name: Change(*change)}, strict=True)
    assert caught.value.code == "edit_out_of_bounds"
    assert caught.value.detail.startswith(f"{name} can't be ")
    assert limit in caught.value.detail
    assert "nearest" in caught.value.suggestion


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("seat_width", ("set", 0.0)),
        ("seat_width", ("set", -1.0)),
        ("leg_height", ("add", -0.36)),
        ("back_height", ("scale", -2.0)),
        ("total_width", ("set", 0.0)),
        ("seat_top_height", ("scale", -1.0)),
    ],
)
def test_a_size_of_nothing_or_less_makes_no_sense(name: str, change: tuple[Kind, float]) -> None:
    with pytest.raises(InvalidRequest) as caught:
        after(box_chair(), **{name: change})
    assert caught.value.code == "size_not_positive"
    assert caught.value.detail.startswith(f"{name} would be ")


def test_what_keeps_the_limits_is_had_to_the_letter() -> None:
    changes = {"seat_width": Change("scale", 3.0), "total_height": Change("set", 1.1)}
    outcome = box_chair().outcome(changes, strict=True)
    assert (outcome.adjusted, outcome.limits) == ({}, ())


def test_an_unknown_name_is_refused_and_the_known_ones_listed() -> None:
    with pytest.raises(InvalidRequest) as caught:
        after(box_chair(), seat_height=("set", 1.0))
    assert caught.value.code == "unknown_parameter"
    assert "'seat_height'" in caught.value.detail
    for name in (*CHAIR.names, *CHAIR.derived):
        assert name in caught.value.suggestion


def test_the_mesh_is_left_as_it_was() -> None:
    dimensions = box_chair()
    parameters, told = dimensions.parameters.copy(), dimensions.derived(F)
    dimensions.outcome({"total_height": Change("set", 1.2), "seat_width": Change("scale", 2)})
    assert np.array_equal(dimensions.parameters, parameters)
    assert dimensions.derived(F) == told


def test_dimensions_by_extent_only_need_no_row() -> None:
    derived = {n: replace(d, row=None, extent="y") for n, d in CHAIR.derived.items()}
    dimensions = Dimensions(
        replace(CHAIR, derived=derived),
        F,
        CHAIR.decode(F),
        columns=columns_of(CHAIR.jacobian, EVERY),
    )
    np.testing.assert_allclose(list(dimensions.derived(F).values()), 0.82)


def cushioned() -> Dimensions:
    """A chair whose seat lies 3 cm above where its parameters say."""
    vertices, jacobian = CHAIR.decode(F), CHAIR.jacobian
    top = vertices[(CHAIR.part == 0), 1].max()
    seat = np.flatnonzero((CHAIR.part == 0) & (vertices[:, 1] == top))
    vertices[seat, 1] += 0.03
    level = Level(seat, np.full(len(seat), 1 / len(seat)))
    return Dimensions(
        CHAIR, F, vertices, 1.0, columns_of(jacobian, EVERY), {"seat_top_height": level}
    )


def on_the_mesh(dimensions: Dimensions, outcome: Outcome, name: str) -> float:
    return dimensions.measured(outcome.change)[name][1]


def test_what_is_asked_of_the_mesh_is_had_on_the_mesh_and_told() -> None:
    dimensions = cushioned()
    outcome = dimensions.outcome({"seat_top_height": Change("set", 0.5)}, strict=True)
    assert on_the_mesh(dimensions, outcome, "seat_top_height") == pytest.approx(0.5)
    assert outcome.derived["seat_top_height"] == pytest.approx(0.5)
    values = named(outcome.parameters)
    assert values == pytest.approx(VALUES | {"leg_height": 0.44})
    moved = named(F + outcome.change)
    assert moved == pytest.approx(VALUES | {"leg_height": 0.41})


def test_relative_changes_are_relative_for_the_mesh_and_for_what_is_told() -> None:
    dimensions = cushioned()
    for change, told, mesh in (
        (Change("add", 0.1), 0.52, 0.55),
        (Change("scale", 1.1), 0.462, 0.495),
        (Change("set", 0.42), 0.42, 0.45),
    ):
        outcome = dimensions.outcome({"seat_top_height": change}, strict=True)
        assert outcome.derived["seat_top_height"] == pytest.approx(told)
        assert on_the_mesh(dimensions, outcome, "seat_top_height") == pytest.approx(mesh)
    same = dimensions.outcome({"seat_top_height": Change("set", 0.42)})
    np.testing.assert_array_equal(same.parameters, F)
    np.testing.assert_array_equal(same.change, 0.0)


def test_a_constraint_is_of_the_mesh_too() -> None:
    dimensions = cushioned()
    lower = dimensions.outcome({}, constraints={"seat_top_height": Interval(high=0.44)})
    assert on_the_mesh(dimensions, lower, "seat_top_height") == pytest.approx(0.44)
    assert lower.derived["seat_top_height"] == pytest.approx(0.44)
    # The mesh keeps this one already, and it is told as the mesh has it.
    kept = dimensions.outcome({}, constraints={"seat_top_height": Interval(low=0.44)})
    np.testing.assert_array_equal(kept.change, 0.0)
    assert kept.derived["seat_top_height"] == pytest.approx(0.45)


def test_a_constraint_on_what_one_parameter_is_behind_is_the_edit() -> None:
    for name in ("total_width", "total_depth"):
        value = with_wings().derived(F)[name] * 1.2
        edited = with_wings().outcome({name: Change("set", value)})
        for interval in (Interval(value, value), Interval(low=value)):
            kept = with_wings().outcome({}, constraints={name: interval})
            np.testing.assert_allclose(kept.parameters, edited.parameters, rtol=1e-6)
        assert kept.asked == {name: Interval(low=value)}


def test_of_several_parameters_each_changes_by_the_square_of_its_size() -> None:
    outcome = box_chair().outcome({}, constraints={"total_height": Interval(high=0.75)})
    sizes = {name: VALUES[name] ** 2 for name in ("back_height", "leg_height", "seat_thickness")}
    shares = {name: -0.07 * size / sum(sizes.values()) for name, size in sizes.items()}
    expected = VALUES | {name: VALUES[name] + share for name, share in shares.items()}
    assert named(outcome.parameters) == pytest.approx(expected)
    assert outcome.derived["total_height"] == pytest.approx(0.75)


@settings(deadline=None, max_examples=30)
@given(
    st.dictionaries(
        st.sampled_from([*CHAIR.names, *CHAIR.derived]),
        st.tuples(st.floats(0.8, 1.25), st.sampled_from(["set", "min", "max"])),
        min_size=1,
        max_size=4,
    )
)
def test_constraints_are_met_or_their_nearest_can_be(wishes: dict[str, tuple[float, str]]) -> None:
    dimensions = with_wings()
    now = VALUES | dimensions.derived(F)
    constraints = {
        name: {
            "set": Interval(now[name] * factor, now[name] * factor),
            "min": Interval(low=now[name] * factor),
            "max": Interval(high=now[name] * factor),
        }[kind]
        for name, (factor, kind) in wishes.items()
    }
    try:
        outcome = dimensions.outcome({}, constraints=constraints)
    except Unsatisfiable as conflict:
        for one in conflict.conflicts:
            ends = constraints[one.name]
            low, high = min(ends.low, one.nearest), max(ends.high, one.nearest)
            constraints[one.name] = Interval(low, high)
        outcome = dimensions.outcome({}, constraints=constraints)
    after = named(outcome.parameters) | outcome.derived
    for name, ends in constraints.items():
        assert ends.low * (1 - 1e-8) <= after[name] <= ends.high * (1 + 1e-8)
    assert (outcome.parameters >= 1e-3 - 1e-9).all()
    assert (CHAIR.relations @ [1.0, *outcome.parameters] > -1e-9).all()


def test_edits_come_first_and_stay() -> None:
    edits = {"leg_height": Change("set", 0.45), "total_width": Change("scale", 1.1)}
    outcome = box_chair().outcome(edits, constraints={"total_height": Interval(0.85, 0.85)})
    after = named(outcome.parameters) | outcome.derived
    assert after["leg_height"] == 0.45
    assert after["total_width"] == pytest.approx(0.528)
    assert after["total_height"] == pytest.approx(0.85)
    assert outcome.adjusted == {}


def test_what_conflicts_with_an_edit_or_a_limit_says_so() -> None:
    edits = {"seat_width": Change("set", 0.5)}
    with pytest.raises(Unsatisfiable) as caught:
        box_chair().outcome(edits, constraints={"total_width": Interval(high=0.4)})
    assert list(caught.value.held) == ["seat_width"]
    (conflict,) = caught.value.conflicts
    assert (conflict.name, conflict.nearest) == ("total_width", pytest.approx(0.5, rel=1e-5))
    with pytest.raises(Unsatisfiable) as caught:
        box_chair().outcome({}, constraints={"leg_width": Interval(high=-1.0)})
    assert list(caught.value.limits) == ["leg_width > 0"]
    with pytest.raises(Unsatisfiable) as caught:
        box_chair().outcome(
            {}, constraints={"leg_width": Interval(low=0.3), "seat_width": Interval(high=0.5)}
        )
    assert list(caught.value.limits) == ["0.8 * seat_width - 2 * leg_width >= 0"]
    assert [c.name for c in caught.value.conflicts] == ["leg_width", "seat_width"]


def test_an_unknown_name_in_a_constraint_is_refused() -> None:
    with pytest.raises(InvalidRequest) as caught:
        box_chair().outcome({}, constraints={"seat_height": Interval(high=1.0)})
    assert caught.value.code == "unknown_parameter"
