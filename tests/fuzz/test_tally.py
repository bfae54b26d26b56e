from __future__ import annotations

from pathlib import Path

from .tally import FAILED, SLOWEST, Tally, resident


def test_answers_are_counted_and_the_slowest_told() -> None:
    tally = Tally()
    for number in range(20):
        tally.add(number, "read" if number % 2 else "empty_mesh", number / 10)
    first, second = tally.lines()
    assert first == "20 files: empty_mesh 10, read 10"
    assert second.startswith("slowest: 1.90 s (file 19, read), 1.80 s (file 18, empty_mesh)")
    assert second.count("file") == SLOWEST


def test_failures_are_kept_and_told(tmp_path: Path) -> None:
    tally = Tally()
    for number in range(FAILED + 2):
        tally.fail(number, "it broke", b"data", tmp_path / "new", "off")
    lines = tally.lines()
    assert lines[0] == f"{FAILED + 2} files: FAILED {FAILED + 2}"
    assert lines[2] == "FAILED file 0: it broke"
    assert lines[-1] == "and 2 more"
    assert (tmp_path / "new" / "failed-3.off").read_bytes() == b"data"


def test_memory_is_some_and_of_no_process_none() -> None:
    assert resident() == 0 or resident() > 10
    assert resident("nobody") == 0
