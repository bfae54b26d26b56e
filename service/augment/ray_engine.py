"""A batch on a cluster: the same work, spread by Ray Data.

Workers write to the batch's folder, which all machines must reach by the same path.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from service.augment.plan import Outcome, Plan, Task
from service.augment.work import Work
from service.errors import InvalidRequest


class _Worker:
    """An actor: one source a call."""

    def __init__(self, plan: Plan) -> None:
        self._work = Work(plan)

    def __call__(self, row: dict[str, Any]) -> dict[str, Any]:
        path, copies = Path(row["path"]), tuple(row["copies"])
        return asdict(self._work(Task(path, row["source"], row["digest"], copies)))


def run_ray(plan: Plan, tasks: Sequence[Task], workers: int) -> Iterator[Outcome]:
    """Outcomes of the tasks, as they come; see `local_engine.run_local`.

    A cluster that is there already (``RAY_ADDRESS``) is used, else one is started on this machine.

    Raises:
        InvalidRequest: ``ray_missing``.
    """
    ray = _ray()
    if not ray.is_initialized():
        ray.init(log_to_driver=False, include_dashboard=False, configure_logging=False)
    rows = [
        {
            "path": str(task.path.resolve()),
            "source": task.source,
            "digest": task.digest,
            "copies": list(task.copies),
        }
        for task in tasks
    ]
    # A block a source: one that is slow keeps no other waiting.
    made = ray.data.from_items(rows, override_num_blocks=len(rows)).map(
        _Worker, fn_constructor_args=(plan,), concurrency=min(workers, len(rows)), num_cpus=1
    )
    for row in made.iter_rows():
        yield Outcome(**row)


def _ray() -> Any:
    try:
        import ray
        import ray.data
    except ModuleNotFoundError as error:
        raise InvalidRequest(
            "ray_missing",
            "engine=ray runs on Ray Data, which is not installed",
            "Install it: pip install 'shape-parameters[batch]'",
        ) from error
    ray.data.DataContext.get_current().enable_progress_bars = False
    os.environ.setdefault("RAY_DEDUP_LOGS", "0")
    return ray
