"""`shape-edit` as a process: exit codes, pipes, signals, streams."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
from cli_runs import extents

PROGRAM = Path(sys.executable).with_name("shape-edit")
LINE = [str(PROGRAM), "infer", "-c", "debug"]


def bash(script: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a script with the program in the PATH."""
    path = f"{PROGRAM.parent}:{os.environ['PATH']}"
    return subprocess.run(
        ["bash", "--norc", "-c", script],
        cwd=folder,
        env={**os.environ, "PATH": path, **environment},
        capture_output=True,
        text=True,
        timeout=120,
    )


def test_exit_codes(box_glb: Path) -> None:
    script = """
        shape-edit infer -q -c debug box.glb; echo $?
        shape-edit infer -q -c debug none.glb; echo $?
        shape-edit infer --sideways; echo $?
        shape-edit infer -q -c debug box.glb --url http://127.0.0.1:9; echo $?
    """
    done = bash(script, box_glb.parent)
    assert done.stdout.split() == ["0", "1", "2", "3"]
    assert "Traceback" not in done.stderr


def test_a_mesh_through_pipes(box_glb: Path) -> None:
    done = bash(
        "cat box.glb | shape-edit edit - width=2m -c debug -o - | "
        "shape-edit edit - height=3m -c debug -q > out.glb",
        box_glb.parent,
    )
    assert done.returncode == 0, done.stderr
    assert extents(box_glb.with_name("out.glb")) == pytest.approx([2.0, 3.0, 0.5], abs=1e-3)
    assert "standard output" in done.stderr


@pytest.mark.parametrize("options", ["--json", ""])
def test_a_reader_who_has_enough_ends_it_without_a_word(box_glb: Path, options: str) -> None:
    script = f"shape-edit infer -c debug {options} box.glb box.glb | true; echo ${{PIPESTATUS[0]}}"
    done = bash(script, box_glb.parent)
    assert done.stdout.split() == ["141"]
    assert done.stderr == ""


def test_ctrl_c(box_glb: Path) -> None:
    process = subprocess.Popen(
        [*LINE, "--json", str(box_glb), "-"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        # Shells start what runs in the background with the signal ignored.
        preexec_fn=partial(signal.signal, signal.SIGINT, signal.SIG_DFL),
    )
    with process:
        assert process.stdout is not None
        assert json.loads(process.stdout.readline())["category"] == "debug"
        process.send_signal(signal.SIGINT)  # it waits for standard input
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert b"Traceback" not in errors


def test_no_colour_goes_to_a_file(box_glb: Path) -> None:
    done = bash("shape-edit infer -c debug box.glb none.glb", box_glb.parent)
    assert "\x1b" not in done.stdout + done.stderr


def test_a_locale_without_boxes(box_glb: Path) -> None:
    script = "shape-edit infer -c debug box.glb"
    done = bash(script, box_glb.parent, PYTHONIOENCODING="ascii", LC_ALL="C")
    assert done.returncode == 0, done.stderr
    assert "0.2 to 2" in done.stdout


def test_help_and_completion_load_no_models() -> None:
    program = (
        "import sys; from service.cli.main import main; main(['edit', '--help']);"
        "print(*sorted({name.split('.')[0] for name in sys.modules}), file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60
    )
    assert "seat_top_height=45cm" in done.stdout
    slow = {"numpy", "scipy", "onnxruntime", "pydantic", "fastapi", "httpx", "rich", "yaml"}
    assert slow.isdisjoint(done.stderr.split())


def test_a_terminal_sees_what_is_worked_on_and_standard_output_does_not(box_glb: Path) -> None:
    master, slave = os.openpty()
    environment = {**os.environ, "TERM": "xterm"}
    line = [*LINE, "--json", str(box_glb)]
    done = subprocess.run(
        line, stdout=subprocess.PIPE, stderr=slave, env=environment, timeout=120, check=True
    )
    os.close(slave)
    seen = os.read(master, 65536).decode()
    os.close(master)
    assert json.loads(done.stdout)["category"] == "debug"
    assert box_glb.name in "".join(seen.split())
