from __future__ import annotations

import numpy as np
import pytest
from boxes import ORIGIN, PARAMETERS, chair

from service.deform.bound import columns_of
from service.deform.measured import Level
from service.deform.readings import Reading, read
from service.edits import Change

STILL = np.zeros(8)
LEG = chair().names.index("leg_height")


def reading(raised: float = 0.0, rises: float = 1.0) -> Reading:
    """The seat's height, of a chair whose fit is off by so much and whose seat follows so far."""
    template = chair()
    vertices = template.decode(PARAMETERS) + ORIGIN
    top = (template.part == 0) & (vertices[:, 1] > ORIGIN[1])
    jacobian = template.jacobian.copy()
    # What the edit leaves in place is the floor.
    jacobian[:, 1] -= jacobian[vertices[:, 1].argmin(), 1]
    jacobian[top] *= rises
    vertices[top, 1] += raised
    rows = np.flatnonzero(top)
    levels = {"seat_top_height": Level(rows, np.full(len(rows), 1 / len(rows)))}
    return read(template, PARAMETERS, vertices, 1.0, columns_of(jacobian, range(8)), levels)[
        "seat_top_height"
    ]


def test_the_mesh_stands_in_for_the_fit() -> None:
    found = reading(0.05)
    assert found.corrects
    assert found.fitted == pytest.approx(0.45)
    assert found.gauge.value(STILL) == pytest.approx(0.50)
    assert found.by == (LEG,)


@pytest.mark.parametrize(("raised", "rises"), [(0.2, 1.0), (-0.2, 1.0), (0.0, 0.3), (0.0, 2.0)])
def test_unless_it_measures_something_else_or_does_not_follow(raised: float, rises: float) -> None:
    found = reading(raised, rises)
    assert not found.corrects
    assert found.mesh is not None
    assert found.gauge.value(STILL) == pytest.approx(0.45)


def test_without_a_level_the_fit_is_all_there_is() -> None:
    vertices = chair().decode(PARAMETERS)
    found = read(chair(), PARAMETERS, vertices, 1.0, columns_of(chair().jacobian, range(8)), {})
    assert found["seat_top_height"].mesh is None
    assert not found["seat_top_height"].corrects
    width = found["total_width"]
    assert width.mesh is width.gauge
    assert not width.corrects


def test_where_legs_move_nothing_all_behind_it_does() -> None:
    template = chair()
    vertices = template.decode(PARAMETERS) + ORIGIN
    top = np.flatnonzero((template.part == 0) & (vertices[:, 1] > ORIGIN[1]))
    thick = template.names.index("seat_thickness")
    jacobian = np.zeros_like(template.jacobian)
    jacobian[top, 1, thick] = PARAMETERS[[LEG, thick]].sum() / PARAMETERS[thick]
    levels = {"seat_top_height": Level(top, np.full(len(top), 1 / len(top)))}
    found = read(template, PARAMETERS, vertices, 1.0, columns_of(jacobian, range(8)), levels)[
        "seat_top_height"
    ]
    assert found.corrects
    assert set(found.by) == {LEG, thick}


def test_what_is_set_is_had_on_the_mesh() -> None:
    aim = reading(0.05).aim(Change("set", 0.6), STILL)
    assert (aim.target, aim.goal) == (0.6, 0.6)
    assert aim.told(0.6) == 0.6


@pytest.mark.parametrize(("kind", "amount"), [("add", 0.0), ("scale", 1.0), ("set", None)])
def test_no_change_is_none(kind: str, amount: float | None) -> None:
    found = reading(0.05)
    change = Change(kind, found.fitted if amount is None else amount)  # type: ignore[arg-type]
    aim = found.aim(change, STILL)
    assert aim.goal == pytest.approx(found.gauge.value(STILL), rel=1e-12)
    assert aim.told(aim.goal) == pytest.approx(found.fitted)


def test_relative_changes_start_from_what_each_has() -> None:
    found = reading(0.05)
    added = found.aim(Change("add", 0.1), STILL)
    assert (added.target, added.goal) == (pytest.approx(0.55), pytest.approx(0.60))
    scaled = found.aim(Change("scale", 1.2), STILL)
    assert (scaled.target, scaled.goal) == (pytest.approx(0.54), pytest.approx(0.60))
    for aim in (added, scaled):
        assert aim.told(aim.goal) == pytest.approx(aim.target)
