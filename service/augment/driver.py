"""Variants of all meshes of a folder: resumable, and the same whichever machine makes which."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from service.augment.local_engine import run_local
from service.augment.manifest import require_arrow
from service.augment.options import AugmentOptions
from service.augment.plan import DIGITS, Models, Outcome, Plan, Task
from service.augment.sources import find_files, find_tasks, read_shard
from service.augment.work import MANIFEST, MESHES
from service.errors import InvalidRequest
from service.mesh.frame import orientations
from service.pipeline import require_mode
from service.requests import EditOptions, InferOptions, require_units

ENGINES = ("local", "ray")
RECORD = "augment.json"
"""What a folder's variants were made with."""
TOLD = 100
"""Failures that a summary tells of by name."""

ANY_MESH, AS_USUAL, SHIPPED_MODELS = InferOptions(), EditOptions(), Models()

Progress = Callable[[int, int, str, int], None]
"""Called with how many sources are done, of how many, the latest one, and how many failed."""


@dataclass
class Summary:
    """What a run did.

    Attributes:
        out: the folder it wrote.
        sources: files that are this run's, equal ones once.
        copies: equal files that were left out.
        kept: sources that were done before.
        done, failed: sources that it did, and how many of them have no variants.
        ok, rejected: variants that it made, and those that could not be had.
        failures: the first failed sources: name, code and detail.
        seconds: that it took.
    """

    out: Path
    sources: int = 0
    copies: int = 0
    kept: int = 0
    done: int = 0
    failed: int = 0
    ok: int = 0
    rejected: int = 0
    failures: list[tuple[str, str, str]] = field(default_factory=list)
    seconds: float = 0.0

    def add(self, outcome: Outcome) -> None:
        """Count what became of a source."""
        self.done += 1
        self.ok += outcome.ok
        self.rejected += outcome.rejected
        if outcome.code is not None:
            self.failed += 1
            if len(self.failures) < TOLD:
                self.failures.append((outcome.source, outcome.code, outcome.detail or ""))


def augment(
    directory: Path | str,
    out: Path | str,
    count: int = 20,
    seed: int = 1,
    strength: float = 1.0,
    *,
    infer: InferOptions = ANY_MESH,
    edit: EditOptions = AS_USUAL,
    models: Models = SHIPPED_MODELS,
    engine: str = "local",
    workers: int | None = None,
    shard: str = "1/1",
    deadline_s: float = 600.0,
    force: bool = False,
    progress: Progress | None = None,
) -> Summary:
    """Make variants of every mesh in a folder, and a manifest of them.

    A source is done once its part of the manifest is there: a run that was ended goes on where it
    was, and a second one does nothing.  Files that can't be used are recorded and left out.

    Args:
        directory: where meshes are, at any depth.
        out: where to write; made if need be.
        count, seed, strength: as `AugmentOptions`, for each source.
        infer, edit: what is said of all the meshes, and how edits are carried out.
        models: where models are.
        engine: ``local`` for processes of this machine, ``ray`` for a cluster.
        workers: how many; by default one a CPU.
        shard: ``i/n``: the i-th of n shares of the sources, for machines that know nothing of each
            other.
        deadline_s: seconds that one source may take.
        force: do again what is done, also with other options than before.
        progress: called now and then; see `Progress`.

    Raises:
        ShapeError: for options that make no sense, a folder without meshes, one that was made
            with other options (``options_differ``), or what is not installed (``pyarrow_missing``,
            ``ray_missing``).
        KeyboardInterrupt: after workers were ended; what is written stays good.
    """
    start = time.monotonic()
    directory, out = Path(directory), Path(out)
    plan = Plan(out, AugmentOptions(count, seed, strength), infer, edit, models, deadline_s)
    run = _engine(engine)
    _require_sound(plan, shard, workers)
    files = find_files(directory, out)
    _settle(plan, force)
    tell = progress or (lambda *_: None)
    tasks = find_tasks(directory, files, shard, lambda: tell(0, len(files), "", 0))
    left = tasks if force else _left(out, tasks)
    copies = sum(len(task.copies) for task in tasks)
    summary = Summary(out, len(tasks), copies, len(tasks) - len(left))
    tell(summary.kept, len(tasks), "", 0)
    if left:
        with closing(run(plan, left, workers or _cpus())) as outcomes:
            for outcome in outcomes:
                summary.add(outcome)
                done = summary.kept + summary.done
                tell(done, len(tasks), outcome.source, summary.failed)
    summary.seconds = time.monotonic() - start
    return summary


Engine = Callable[[Plan, Sequence[Task], int], Iterator[Outcome]]


def _engine(name: str) -> Any:
    if name == "local":
        return run_local
    if name == "ray":
        from service.augment.ray_engine import run_ray

        return run_ray
    raise InvalidRequest(
        "unknown_engine", f"engine={name[:40]!r} is no engine", f"Use {' or '.join(ENGINES)}."
    )


def _require_sound(plan: Plan, shard: str, workers: int | None) -> None:
    require_arrow()
    plan.augment.require_sound()
    require_mode(plan.edit.mode)
    require_units(plan.infer.units)
    orientations(plan.infer.up, plan.infer.front)
    read_shard(shard)
    for name, value in (("workers", workers), ("deadline_s", plan.deadline_s)):
        if value is not None and not value > 0:
            raise InvalidRequest(
                f"{name}_out_of_range", f"{name} is {value}", "Choose a larger number."
            )


def _cpus() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _settle(plan: Plan, force: bool) -> None:
    """Make the folder, and see that what is in it was made with the same options."""
    for folder in (MESHES, MANIFEST):
        (plan.out / folder).mkdir(parents=True, exist_ok=True)
    path = plan.out / RECORD
    now = plan.recorded(plan.models.load(plan.infer.category))
    before = None if force else _recorded(path)
    if before is not None and before != json.loads(json.dumps(now)):
        names = [name for name in now if before.get(name) != json.loads(json.dumps(now[name]))]
        raise InvalidRequest(
            "options_differ",
            f"{str(plan.out)!r} was made with other options: {', '.join(names) or 'older ones'}",
            "Write to another folder, or force these options, which makes all anew.",
        )
    temporary = path.with_name(f".{RECORD}.{os.getpid()}")
    temporary.write_text(json.dumps(now, indent=2) + "\n", "utf-8")
    temporary.replace(path)


def _recorded(path: Path) -> dict[str, Any] | None:
    try:
        return dict(json.loads(path.read_text("utf-8")))
    except FileNotFoundError:
        return None
    except ValueError:
        return {}


def _left(out: Path, tasks: Sequence[Task]) -> list[Task]:
    """Those without a part in the manifest, under whichever name."""
    done = {path.stem[-DIGITS:] for path in (out / MANIFEST).glob("[!.]*.parquet")}
    return [task for task in tasks if task.digest[:DIGITS] not in done]
