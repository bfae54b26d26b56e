from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.errors import InvalidRequest
from service.mesh.stretch import Stretch
from service.sliders import Slider, chosen, size_range, targets_of


def slider(value: float = 0.5, low: float = 0.2, high: float = 0.8) -> Slider:
    return Slider("width", "Width", "seat", "m", "length", 0.01, value, 0.002, low, high)


def test_chosen_names_come_in_the_categorys_order() -> None:
    assert chosen(["a", "b", "c"], None, "chair") == ["a", "b", "c"]
    assert chosen(["a", "b", "c"], ["c", "a"], "chair") == ["a", "c"]


@pytest.mark.parametrize(
    ("wanted", "code"), [(["d"], "unknown_parameter"), ([], "parameters_empty")]
)
def test_names_that_make_no_sense(wanted: list[str], code: str) -> None:
    with pytest.raises(InvalidRequest) as error:
        chosen(["a", "b", "c"], wanted, "chair")
    assert error.value.code == code
    assert "a, b, c" in error.value.suggestion


@given(st.floats(1e-3, 1e3), st.floats(1e-3, 1e3), st.floats(0, 1e3))
def test_ranges_hold_the_value_with_room_to_either_side(
    value: float, low: float, width: float
) -> None:
    ends = size_range(value, (low, low + width))
    assert ends[0] <= 0.7 * value
    assert ends[1] >= 1.4 * value
    assert ends[0] <= low <= low + width <= ends[1]


def test_a_weight_of_one_leads_to_the_upper_end() -> None:
    (target,) = targets_of(slider(), np.ones((4, 3)), Stretch({}), False)
    assert target.extras["change"] == pytest.approx(0.3)
    assert np.allclose(target.shift, 0.3)


def test_pairs_lead_to_both_ends() -> None:
    up, down = targets_of(slider(), np.ones((4, 3)), Stretch({}), True)
    assert (up.name, down.name) == ("width+", "width-")
    assert np.allclose(up.shift, 0.3)
    assert np.allclose(down.shift, -0.3)
    assert up.extras["parameter"] == down.extras["parameter"] == "width"


def test_at_an_end_there_is_one_way() -> None:
    at_the_top = slider(value=0.8)
    assert at_the_top.change == pytest.approx(-0.6)
    (down,) = targets_of(at_the_top, np.ones((4, 3)), Stretch({}), True)
    assert down.name == "width-"
