from __future__ import annotations

import subprocess
import sys

import pytest

from service.api.keys import Keys
from service.newkey import main


def test_the_entry_lets_the_key_in(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["ann"]) == 0
    key, entry = capsys.readouterr().out.splitlines()
    assert Keys(entry).owner(key) == "ann"


def test_a_name_that_makes_no_sense(capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("", "a b", "a:b", "-a"):
        with pytest.raises(SystemExit) as caught:
            main(["--", name])
        assert caught.value.code == 2
    assert "sp_" not in capsys.readouterr().out


def test_the_command() -> None:
    command = [sys.executable, "-m", "service.newkey", "ci.bot"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    key, entry = done.stdout.splitlines()
    assert Keys(entry).owner(key) == "ci.bot"
    assert key not in done.stderr
