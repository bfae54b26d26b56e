"""The table of settings that operators read is what the service reads."""

from __future__ import annotations

from settings_table import DOCUMENT, renewed, table

from service.settings import Settings


def test_the_table_in_the_docs_is_up_to_date() -> None:
    text = DOCUMENT.read_text("utf-8")
    assert renewed(text) == text, "run .venv/bin/python tests/docker/settings_table.py"


def test_every_setting_has_its_line() -> None:
    names = [line.split("`")[1] for line in table().splitlines()[2:]]
    assert [name.lower() for name in names] == list(Settings.model_fields)
    assert all(line.rsplit("|", 2)[1].strip() for line in table().splitlines()[2:])


def test_defaults_are_told_with_their_units() -> None:
    lines = {line.split("`")[1]: line for line in table().splitlines()[2:]}
    assert "| `134217728` (128 MiB) |" in lines["MAX_UPLOAD_BYTES"]
    assert "| `8000` |" in lines["PORT"]
    assert "|  |" in lines["STORE_DIR"]
