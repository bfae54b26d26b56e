from __future__ import annotations

from pathlib import Path

import pytest

from service.api import build


def test_any_change_of_code_or_templates_is_another_build(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(build, "ROOT", tmp_path)
    seen = set()

    def note() -> None:
        build.build.cache_clear()
        seen.add(build.build())

    note()
    code = tmp_path / "deform" / "blend.py"
    code.parent.mkdir()
    code.write_text("a = 1")
    note()
    code.write_text("a = 2")
    note()
    code.rename(tmp_path / "blend.py")
    note()
    (tmp_path / "chair.yaml").write_text("")
    note()
    assert len(seen) == 5
    (tmp_path / "model.onnx").write_text("")
    note()
    assert len(seen) == 5
    build.build.cache_clear()


def test_it_is_found_once_and_is_the_same_in_every_process() -> None:
    first = build.build()
    assert build.build() is first
    build.build.cache_clear()
    assert build.build() == first
