from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import httpx
import pytest

GUIDE = (Path(__file__).parents[2] / "docs/client.md").read_text("utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", GUIDE, re.DOTALL)


def test_the_examples_run(
    service_client: httpx.Client,
    chair_glb: bytes,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("chair.glb").write_bytes(chair_glb)
    space: dict[str, Any] = {"URL": str(service_client.base_url)}
    for block in BLOCKS:
        exec(compile(block, "client.md", "exec"), space)
    space["client"].close()
    told = capsys.readouterr().out
    assert "unknown_parameter: chair has no parameter 'seat_with'" in told
    assert "1 variants/001.glb" in told
    assert "5 of 5" in told
    made = {path.name for path in tmp_path.iterdir()}
    assert made >= {"wide.glb", "narrow.glb", "like-the-wide-one.glb", "sliders.glb", "large.glb"}
    assert made >= {"variants", "variants.zip"}
