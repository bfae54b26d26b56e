"""Every command's help has examples, and they work as they stand."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from functools import cache
from glob import glob
from pathlib import Path
from typing import Any

import click
import pytest
import trimesh
from cli_runs import Run, box
from pretend_body import saved

import service.__main__
from service.augment import driver
from service.cli.local import Local
from service.cli.main import cli
from service.client import ShapeClient
from service.encode.installed import Installed
from service.template.skinned import Body, SkinnedTemplate

EXAMPLE = re.compile(r"^ {2,}(.*shape-edit .+?)(?: {3,}#.*)?$")


def commands(group: click.Group = cli, path: tuple[str, ...] = ()) -> Iterator[tuple[str, str]]:
    """Each command's name and help, with those of groups within."""
    for name, command in group.commands.items():
        yield " ".join([*path, name]), command.help or ""
        if isinstance(command, click.Group):
            yield from commands(command, (*path, name))


def examples(text: str) -> list[str]:
    _, _, given = text.partition("Examples:\n")
    return [found[1] for line in given.splitlines() if (found := EXAMPLE.match(line))]


ALL = [line for _, text in [("", cli.help or ""), *commands()] for line in examples(text)]


@pytest.mark.parametrize(("name", "text"), list(commands()))
def test_every_command_has_an_example(name: str, text: str) -> None:
    lines = examples(text)
    assert lines
    assert all(f"shape-edit {name}" in line for line in lines)


@pytest.fixture(scope="module")
def meshes(
    chair_glb: bytes, box_chair: trimesh.Trimesh, human: SkinnedTemplate, strider: Body
) -> dict[str, bytes]:
    throne = box_chair.copy()
    throne.apply_scale([1.2, 1.1, 1.0])
    return {
        "chair.glb": chair_glb,
        "throne.glb": bytes(throne.export(file_type="glb")),
        "person.glb": saved(human, strider, "glb").data,
    }


@pytest.fixture(scope="module")
def loads() -> Any:
    """Loads models once."""
    return cache(Local._load)


@pytest.fixture
def folder(
    tmp_path: Path, meshes: dict[str, bytes], loads: Any, monkeypatch: pytest.MonkeyPatch
) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CATEGORIES", "chair,human")
    monkeypatch.setenv("SHELL", "/bin/bash")
    once = Local()

    def load(self: Local, name: str | None) -> Installed:
        return loads(once, name)

    monkeypatch.setattr(Local, "_load", load)
    (tmp_path / "chairs").mkdir()
    monkeypatch.setattr(service.__main__, "main", lambda arguments, program: 0)
    # Its workers are processes of their own, which load models anew; it has tests of its own.
    monkeypatch.setattr(driver, "augment", lambda directory, out, **_: driver.Summary(out))
    return tmp_path


@pytest.mark.parametrize("line", ALL)
def test_examples_work_as_they_stand(
    line: str, shape_edit: Run, folder: Path, meshes: dict[str, bytes], debug_url: str
) -> None:
    needed = [name for name in meshes if name in line] or ["chair.glb", "throne.glb"]
    for name in needed:
        (folder / name).write_bytes(meshes[name])
    if " jobs " in line:
        (folder / "box.glb").write_bytes(bytes(box().export(file_type="glb")))
        with ShapeClient(debug_url) as client:
            job = client.submit_augment(folder / "box.glb", category="debug", count=1).id
        line = re.sub(r"job-\w+", job, line).replace("http://127.0.0.1:8000", debug_url)
        line += "" if "--url" in line else f" --url {debug_url}"
    piped = None
    if (source := re.match(r"cat (\S+) \| ", line)) is not None:
        piped, line = meshes[source[1]], line[source.end() :]
    inner = re.search(r'"\$\((.+)\)"', line)
    words = shlex.split(inner[1] if inner else line.partition(" > ")[0])
    words = words[words.index("shape-edit") + 1 :]
    files = [file for word in words for file in (sorted(glob(word)) if "*." in word else [word])]
    done = shape_edit(*files, piped=piped)
    assert done.exit_code == 0, done.output
    assert done.stdout or " serve" in line
