from __future__ import annotations

from pathlib import Path

import pytest

from model_export.templatecopy import keep_template, require_same_template, template_copy


def test_a_run_keeps_its_template_file(stand_file: Path, tmp_path: Path) -> None:
    folder, own = tmp_path / "run", tmp_path / "mine.yaml"
    own.write_bytes(stand_file.read_bytes())
    keep_template(folder, str(own))
    assert template_copy(folder, str(own)).read_bytes() == stand_file.read_bytes()
    require_same_template(folder, str(own))
    own.write_text("name: other\n", "utf-8")
    with pytest.raises(ValueError, match=r"mine\.yaml has changed since the run"):
        require_same_template(folder, str(own))


def test_a_run_in_the_templates_own_folder_leaves_it(stand_file: Path, tmp_path: Path) -> None:
    own = tmp_path / "mine.yaml"
    own.write_bytes(stand_file.read_bytes())
    keep_template(tmp_path, str(own))
    assert own.read_bytes() == stand_file.read_bytes()


def test_a_built_in_template_needs_no_copy(tmp_path: Path) -> None:
    keep_template(tmp_path / "run", "chair")
    assert list((tmp_path / "run").iterdir()) == []
    require_same_template(tmp_path / "run", "chair")
