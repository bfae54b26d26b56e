"""How many files were answered how, which took longest, and which must be looked into."""

from __future__ import annotations

import heapq
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

SLOWEST, FAILED = 5, 10
"""Slowest answers and failures that are told."""


@dataclass
class Tally:
    """The outcome of many files, sent one way.

    Attributes:
        answers: how often each answer came.
        slowest: seconds, number and answer of the slowest files.
        failures: number of each failed file, and what was wrong.
    """

    answers: Counter[str] = field(default_factory=Counter)
    slowest: list[tuple[float, int, str]] = field(default_factory=list)
    failures: dict[int, str] = field(default_factory=dict)

    def add(self, number: int, answer: str, seconds: float) -> None:
        """Count an answer to file `number`."""
        self.answers[answer] += 1
        entry = (seconds, number, answer)
        if len(self.slowest) < SLOWEST:
            heapq.heappush(self.slowest, entry)
        else:
            heapq.heappushpop(self.slowest, entry)

    def fail(self, number: int, fault: str, data: bytes, keep: Path, suffix: str) -> None:
        """Note a failure, and keep the file as ``failed-<number>.<suffix>`` in folder `keep`."""
        self.answers["FAILED"] += 1
        self.failures[number] = fault
        keep.mkdir(parents=True, exist_ok=True)
        (keep / f"failed-{number}.{suffix}").write_bytes(data)

    def lines(self) -> list[str]:
        """The report."""
        counts = ", ".join(f"{answer} {count}" for answer, count in self.answers.most_common())
        slow = ", ".join(f"{s:.2f} s (file {n}, {a})" for s, n, a in sorted(self.slowest)[::-1])
        failed = [f"FAILED file {number}: {fault}" for number, fault in self.failures.items()]
        failed[FAILED:] = [f"and {len(failed) - FAILED} more"] if len(failed) > FAILED else []
        return [f"{self.answers.total()} files: {counts}", f"slowest: {slow}", *failed]


def resident(pid: int | str = "self") -> float:
    """Memory of a process in MiB, 0 where the system does not tell or it is no more."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return 0.0
    found = status.partition("VmRSS:")[2].split()
    return int(found[0]) / 1024 if found else 0.0
