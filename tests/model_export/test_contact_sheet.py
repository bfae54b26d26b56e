from __future__ import annotations

from types import SimpleNamespace

import pytest

from model_export.contact_sheet import public_names
from service.template.loader import load_template


@pytest.mark.parametrize(("category", "count"), [("airplane", 6), ("chair", 8)])
def test_edits_are_drawn_of_what_users_see(category: str, count: int) -> None:
    names = public_names(SimpleNamespace(template=load_template(category)))
    assert len(names) == count
    assert "wing_sweep" not in names
