from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from cli_runs import Run

from service.cli.shells import SHELLS

PROGRAM = Path(sys.executable).with_name("shape-edit")


def completed(shape_edit: Run, *words: str) -> list[str]:
    """What bash is told for the last of the words."""
    from click.testing import CliRunner

    from service.cli.main import PROGRAM as NAME
    from service.cli.main import cli

    environment = {
        "_SHAPE_EDIT_COMPLETE": "bash_complete",
        "COMP_WORDS": " ".join([NAME, *words]),
        "COMP_CWORD": str(len(words)),
    }
    return CliRunner(env=environment).invoke(cli, prog_name=NAME).stdout.split()


def values(answers: list[str]) -> list[str]:
    return [answer.removeprefix("plain,") for answer in answers]


def test_commands_and_options_complete(shape_edit: Run) -> None:
    assert values(completed(shape_edit, "in")) == ["infer"]
    assert values(completed(shape_edit, "edit", "--dry")) == ["--dry-run"]
    assert values(completed(shape_edit, "infer", "--units", "")) == ["m", "cm", "mm", "in", "ft"]


def test_categories_complete(shape_edit: Run) -> None:
    assert values(completed(shape_edit, "infer", "-c", "")) == [
        "auto",
        "airplane",
        "chair",
        "human",
    ]
    assert values(completed(shape_edit, "categories", "c")) == ["chair"]


def test_parameters_complete(shape_edit: Run) -> None:
    assert values(completed(shape_edit, "edit", "a.glb", "seat_t")) == [
        "seat_thickness=",
        "seat_top_height=",
    ]
    assert "left_elbow_y=" in values(completed(shape_edit, "edit", "a.glb", "left_"))
    assert values(completed(shape_edit, "edit", "-c", "chair", "a.glb", "left_")) == ["file,left_"]
    assert values(completed(shape_edit, "sliders", "a.glb", "-p", "seat_width,leg_h")) == [
        "seat_width,leg_height"
    ]


def test_points_complete(shape_edit: Run) -> None:
    assert values(completed(shape_edit, "edit", "-c", "human", "--keep", "")) == ["floor", "pelvis"]


@pytest.mark.parametrize("command", ["infer", "edit", "sliders", "transfer"])
def test_files_complete(shape_edit: Run, command: str) -> None:
    assert completed(shape_edit, command, "../some") == ["file,../some"]


@pytest.mark.parametrize("shell", SHELLS)
def test_each_shell_has_a_script(shape_edit: Run, shell: str) -> None:
    done = shape_edit("completion", shell)
    assert done.exit_code == 0
    assert "_SHAPE_EDIT_COMPLETE" in done.stdout
    assert done.stderr == ""


def test_the_shell_is_that_of_the_environment(
    shape_edit: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SHELL", "/usr/bin/fish")
    assert "function _shape_edit_completion" in shape_edit("completion").stdout
    monkeypatch.setenv("SHELL", "/bin/tcsh")
    assert shape_edit("completion").exit_code == 2


BASH = """
eval "$(shape-edit completion bash)"
complete_line() {
    COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMPREPLY=()
    compopt() { echo "compopt $2"; }
    _shape_edit_completion shape-edit
    printf '%s\\n' "${COMPREPLY[@]}"
}
complete_line shape-edit edit a.glb seat_w
complete_line shape-edit transf
"""


def test_bash_itself_completes_and_puts_no_space_behind_a_name() -> None:
    done = subprocess.run(
        ["bash", "--norc", "-c", BASH],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
        env={**os.environ, "PATH": f"{PROGRAM.parent}:{os.environ['PATH']}"},
    )
    assert done.stdout.split("\n") == ["compopt nospace", "seat_width=", "transfer", ""]
    assert done.stderr == ""
