"""Every rival on every input; results are kept line by line, and a run that is cut off goes on."""

from __future__ import annotations

import json
import multiprocessing
import signal
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from types import FrameType
from typing import Any

from model_export.benchmark.case import Case
from model_export.benchmark.score import Judge
from model_export.rivals.registry import Entry
from model_export.rivals.subject import Edit

Row = dict[str, Any]

GRACE = 10.0
"""Seconds after its limit that a process of its own is stopped."""


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
                measure = _measured_apart if rival.apart else _measured
                results.add(row | measure(case, known, rival, judge))


def _measured(case: Case, known: str, rival: Entry, judge: Judge) -> Row:
    """Scores of all edits, and what went wrong."""
    began = time.monotonic()
    edits = _edits(case, known, rival)
    scores: list[Row] = []
    failure, bound = None, 0.0
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
    return _row(case, edits, bound, time.monotonic() - began, failure, scores)


def _measured_apart(case: Case, known: str, rival: Entry, judge: Judge) -> Row:
    """The same in a process of its own: a crash is a failure like others."""
    began = time.monotonic()
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)

    def work() -> None:
        sender.send(_measured(case, known, rival, judge))

    process = context.Process(target=work)
    with warnings.catch_warnings():
        # Other threads of this process are idle.
        warnings.simplefilter("ignore", DeprecationWarning)
        process.start()
    sender.close()
    try:
        if receiver.poll(rival.limit + GRACE):
            return dict(receiver.recv())
        failure = f"TimeoutError: took longer than {rival.limit:g} s"
    except EOFError:
        process.join()
        failure = f"crashed: exit code {process.exitcode}"
    finally:
        process.kill()
        process.join()
        receiver.close()
    return _row(case, _edits(case, known, rival), 0.0, time.monotonic() - began, failure, [])


def _edits(case: Case, known: str, rival: Entry) -> list[Edit]:
    edits = list(case.edits(known))
    # What takes seconds is asked for one factor alone.
    return edits[1::2] if rival.makes_anew else edits


def _row(
    case: Case, edits: list[Edit], bound: float, seconds: float, failure: str | None,
    scores: list[Row],
) -> Row:  # fmt: skip
    return {
        "vertices": len(case.vertices),
        "edits": len(edits),
        "bound_s": round(bound, 3),
        "seconds": round(seconds, 3),
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
