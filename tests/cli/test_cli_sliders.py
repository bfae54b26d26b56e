from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import pytest
from cli_runs import Run, documents


def document(data: bytes) -> dict[str, Any]:
    """The JSON chunk of a GLB."""
    (length,) = struct.unpack_from("<I", data, 12)
    found: dict[str, Any] = json.loads(data[20 : 20 + length])
    return found


def test_sliders_lie_beside_the_mesh(anywhere: Run, box_glb: Path) -> None:
    done = anywhere("sliders", box_glb, "-c", "debug", "-p", "width, height")
    assert done.exit_code == 0, done.output
    out = box_glb.with_name("box-sliders.glb")
    (mesh,) = document(out.read_bytes())["meshes"]
    assert mesh["extras"]["targetNames"] == ["width", "height"]
    assert done.stdout == f"{box_glb} -> {out} ({out.stat().st_size:,} bytes)\n"
    assert anywhere("sliders", box_glb, "-c", "debug").exit_code == 1  # it is there


@pytest.mark.parametrize("command", ["sliders", "template"])
@pytest.mark.parametrize("options", [[], ["--paired", "--quantize"], ["--keep", "center"]])
def test_both_make_the_same(
    shape_edit: Run, debug_url: str, box_glb: Path, command: str, options: list[str]
) -> None:
    line = [command, box_glb, "-c", "debug", *options, "-o", "-"]
    here, there = shape_edit(*line), shape_edit(*line, "--url", debug_url)
    assert here.exit_code == there.exit_code == 0
    assert here.stdout_bytes == there.stdout_bytes
    assert here.stdout_bytes.startswith(b"glTF")


def test_programs_are_told_where_it_is(anywhere: Run, box_glb: Path, tall_glb: Path) -> None:
    folder = box_glb.parent / "new"
    line = ["template", box_glb, tall_glb, "-c", "debug", "-o", f"{folder}/", "--json"]
    one, two = documents(anywhere(*line))
    out = folder / "box-template.glb"
    assert one == {"file": str(box_glb), "output": str(out), "bytes": out.stat().st_size}
    assert two["output"] == str(folder / "tall-template.glb")


def test_both_refuse_in_the_same_words(shape_edit: Run, debug_url: str, box_glb: Path) -> None:
    line = ["sliders", box_glb, "-c", "debug", "-p", "zebra", "-o", "never.glb"]
    here, there = shape_edit(*line), shape_edit(*line, "--url", debug_url)
    assert here.exit_code == there.exit_code == 1
    assert "unknown_parameter" in here.stderr
    assert there.stderr.startswith(here.stderr)
