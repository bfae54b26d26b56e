from __future__ import annotations

import numpy as np
import pytest
from boxes import PARAMETERS, chair

from service.constraints import Interval
from service.deform.outcome import Outcome, accorded
from service.deform.readings import Reading, read

NAMES = chair().names
LEG, THICK = NAMES.index("leg_height"), NAMES.index("seat_thickness")


@pytest.fixture
def reading() -> Reading:
    vertices = chair().decode(PARAMETERS)
    return read(chair(), PARAMETERS, vertices, 1.0, {}, {})["seat_top_height"]


def free(*but: int) -> np.ndarray:
    return ~np.isin(np.arange(8), but)


def test_the_parameters_behind_a_dimension_accord_with_it(reading: Reading) -> None:
    found = accorded(PARAMETERS, reading, 0.6, free())
    assert found[LEG] + found[THICK] == pytest.approx(0.6)
    assert np.flatnonzero(found != PARAMETERS).tolist() == [LEG]


def test_those_that_were_named_stay(reading: Reading) -> None:
    found = accorded(PARAMETERS, reading, 0.47, free(LEG))
    assert np.flatnonzero(found != PARAMETERS).tolist() == [THICK]
    assert found[LEG] + found[THICK] == pytest.approx(0.47)
    np.testing.assert_array_equal(accorded(PARAMETERS, reading, 0.6, free(LEG, THICK)), PARAMETERS)


def test_no_size_is_told_to_be_nothing(reading: Reading) -> None:
    np.testing.assert_array_equal(accorded(PARAMETERS, reading, 0.04, free()), PARAMETERS)


def test_what_accords_stays_to_the_bit(reading: Reading) -> None:
    assert accorded(PARAMETERS, reading, reading.fitted, free()) is PARAMETERS


def test_what_was_adjusted_is_refused_with_the_reason() -> None:
    outcome = Outcome(
        PARAMETERS, PARAMETERS, {}, {"leg_width": (0.4, 0.19)}, ("leg_width > 0",),
        {"leg_width": Interval(0.4, 0.4)},
    )  # fmt: skip
    error = outcome.refused()
    assert error.detail == "leg_width can't be 0.4: leg_width > 0 would not be kept"
    assert "0.19" in error.suggestion
