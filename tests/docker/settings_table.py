"""The table of settings in docs/deploy.md: what `Settings` says of itself.

    .venv/bin/python tests/docker/settings_table.py

writes it anew.
"""

from __future__ import annotations

from pathlib import Path

from pydantic import SecretStr
from pydantic.fields import FieldInfo

from service.settings import Settings

DOCUMENT = Path(__file__).parents[2] / "docs/deploy.md"
HEAD = "| setting | default | what it is |\n|---|---|---|\n"
MEBIBYTE = 1 << 20


def table() -> str:
    """A line for each setting."""
    return HEAD + "".join(_line(name, field) for name, field in Settings.model_fields.items())


def _line(name: str, field: FieldInfo) -> str:
    meaning = " ".join((field.description or "").split())
    return f"| `{name.upper()}` | {_default(field)} | {meaning} |\n"


def _default(field: FieldInfo) -> str:
    value = field.get_default(call_default_factory=True, validated_data={})
    if isinstance(value, SecretStr):
        value = value.get_secret_value()
    if isinstance(value, tuple):
        value = ",".join(value)
    if value in (None, "", {}):
        return ""
    if isinstance(value, int) and value and value % MEBIBYTE == 0:
        return f"`{value}` ({value // MEBIBYTE} MiB)"
    return f"`{value}`"


def renewed(text: str) -> str:
    """A document with its table written anew; ValueError when it has none."""
    start = text.index(HEAD)
    end = text.index("\n\n", start) + 1
    return text[:start] + table() + text[end:]


if __name__ == "__main__":
    DOCUMENT.write_text(renewed(DOCUMENT.read_text("utf-8")), "utf-8")
