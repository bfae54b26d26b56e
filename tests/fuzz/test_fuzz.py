"""A short search for a file that a reader fails on; the package says how to make it a long one."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from .corpus import formats

RUNS = 1000
ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("format", formats())
def test_no_file_is_found_that_breaks_a_reader(format: str, tmp_path: Path) -> None:
    pytest.importorskip("atheris", reason="has no wheel for this platform")
    command = [sys.executable, "-m", "tests.fuzz", format, "--runs", str(RUNS), "--seed", "1"]
    found = subprocess.run(
        [*command, "--keep", str(tmp_path)], cwd=ROOT, capture_output=True, text=True, timeout=120
    )
    assert found.returncode == 0, found.stdout[-2000:] + found.stderr[-4000:]
    assert list(tmp_path.iterdir()) == []
    # More seeds than the files it began with: it saw code of the readers run.
    executed, new = (
        int(line.split()[-1])
        for line in found.stderr.splitlines()
        if "number_of_executed_units" in line or "new_units_added" in line
    )
    assert executed >= RUNS
    assert new > 20
