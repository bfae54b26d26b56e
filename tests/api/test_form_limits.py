from __future__ import annotations

from service.api.form_limits import FIELDS, overrun
from service.api.forms import EditForm, InferForm, SlidersForm, TransferForm


def test_every_form_fits_with_room_for_slips() -> None:
    for form in (InferForm, EditForm, SlidersForm, TransferForm):
        assert 2 * len(form.model_fields) <= FIELDS


def test_other_faults_are_no_overruns() -> None:
    assert overrun("Missing boundary in multipart.") is None
    assert overrun("There was an error parsing the body") is None
