"""Every rival on every input; results are kept line by line, and a run that is cut off goes on."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from types import FrameType
from typing import Any

from model_export.benchmark.case import Case
from model_export.benchmark.score import Judge
from model_export.rivals.registry import Entry

Row = dict[str, Any]


class Results:
    """A file of JSON lines, one for each input, knowledge and rival."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.rows: list[Row] = list(_read(path))
        self._done = {_key(row) for row in self.rows}

    def has(self, row: Mapping[str, Any]) -> bool:
        """Whether there is one of the same input, knowledge and rival."""
        return _key(row) in self._done

    def add(self, row: Row) -> None:
        """Keep a row, in the file first."""
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        self.rows.append(row)
        self._done.add(_key(row))


def _read(path: Path) -> Iterator[Row]:
    if not path.is_file():
        return
    for line in path.read_text("utf-8").splitlines():
        try:
            yield json.loads(line)
        except json.JSONDecodeError:
            # The line that a run was cut off at.
            continue


def _key(row: Mapping[str, Any]) -> tuple[str, ...]:
    return tuple(str(row[name]) for name in ("source", "category", "input", "known", "rival"))


def run_case(
    case: Case,
    number: int,
    rivals: Mapping[str, Entry],
    results: Results,
    say: Callable[[str], None],
) -> None:
    """Score each rival on a case, with each way of knowing its parameters.

    Rivals that are shown the truth run once, and only where there is one.

    Args:
        case: the input.
        number: of it among its source's.
        rivals: by name.
        results: where rows go; those that are there are not made again.
        say: told what is done next.
    """
    judge = Judge(case)
    for known in case.known:
        for name, rival in rivals.items():
            if rival.most is not None and number >= rival.most:
                continue
            if rival.knows_truth and (known != next(iter(case.known)) or not case.truths):
                continue
            row = {
                "source": case.source,
                "category": case.category.name,
                "input": case.name,
                "known": "truth" if rival.knows_truth else known,
                "rival": name,
            }
            if not results.has(row):
                say(f"{case.source} {case.name}: {name}, {row['known']}")
                results.add(row | _measured(case, known, rival, judge))


def _measured(case: Case, known: str, rival: Entry, judge: Judge) -> Row:
    """Scores of all edits, and what went wrong."""
    began = time.monotonic()
    edits, scores, failure = list(case.edits(known)), [], None
    if rival.makes_anew:
        # What takes seconds is asked for one factor alone.
        edits = edits[1::2]
    bound = 0.0
    try:
        with time_limit(rival.limit):
            editor = rival.rule(case.subject(known))
            bound = time.monotonic() - began
            for edit in edits:
                score = judge.score(edit, editor(edit))
                scores.append({"edit": edit.name, "factor": edit.factor, **asdict(score)})
    except Exception as error:
        # Whatever a library does to such a mesh is a finding, not the end of the run.
        failure = f"{type(error).__name__}: {error}"[:200]
    return {
        "vertices": len(case.vertices),
        "edits": len(edits),
        "bound_s": round(bound, 3),
        "seconds": round(time.monotonic() - began, 3),
        "failure": failure,
        "scores": scores,
    }


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise `TimeoutError` in the main thread when it takes longer."""

    def stop(number: int, frame: FrameType | None) -> None:
        raise TimeoutError(f"took longer than {seconds:g} s")

    previous = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, previous)
