"""The work of a batch, one source at a time: what every engine calls."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from service import deadline, malloc
from service.augment.labels import category_parts
from service.augment.manifest import Manifest, source_facts, variant_row
from service.augment.plan import Outcome, Plan, Task
from service.augment.variants import Source, source
from service.encode.versions import choose
from service.errors import ModelFault, ShapeError
from service.requests import Upload

MESHES, MANIFEST = "meshes", "manifest"


class Work:
    """Makes the variants of sources; holds the models, loaded once."""

    def __init__(self, plan: Plan) -> None:
        malloc.settle()
        threadpool_limits(1, user_api="blas")
        self._plan = plan
        self._models = plan.models.load(plan.infer.category)
        served = choose(self._models, plan.infer.category)
        parts = {model.name: category_parts(model) for model in served}
        self._manifest = Manifest(served, plan.infer.units, parts)

    def __call__(self, task: Task) -> Outcome:
        """Make a source's variants and its part of the manifest.

        What is wrong with the file is recorded there and answered; that nothing can be written is
        raised.
        """
        try:
            return self._made(task)
        finally:
            malloc.trim()

    def failed(self, task: Task, code: str, detail: str) -> Outcome:
        """Record that a source has no variants, and why."""
        facts = {"status": "failed", "problem_code": code, "problem_detail": detail}
        self._record(task, [facts])
        return Outcome(task.source, code=code, detail=detail)

    def _made(self, task: Task) -> Outcome:
        try:
            data = task.path.read_bytes()
        except OSError as error:
            return self.failed(task, "unreadable", f"the file can't be read: {error.strerror}")
        plan = self._plan
        upload = Upload(data, task.path.name)
        try:
            with (
                deadline.limit(plan.deadline_s),
                source(upload, self._models, plan.infer, plan.edit) as made,
            ):
                return self._written(task, made)
        except ModelFault:
            raise
        except ShapeError as error:
            return self.failed(task, error.code, error.detail)

    def _written(self, task: Task, made: Source) -> Outcome:
        folder = f"{MESHES}/{task.name}"
        final = self._plan.out / folder
        # Those of runs that were ended go; a worker that outlives one can't go on in them.
        for left in final.parent.glob(f".{task.name}.*"):
            shutil.rmtree(left, ignore_errors=True)
        temporary = final.with_name(f".{task.name}.{os.getpid()}.tmp")
        temporary.mkdir(parents=True)
        facts, rows, ok = source_facts(made.found, made.labels), [], 0
        for variant in made.variants(self._plan.augment):
            if variant.edited and variant.name:
                (temporary / variant.name).write_bytes(variant.edited.data)
                ok += 1
            rows.append(facts | variant_row(variant, folder))
        shutil.rmtree(final, ignore_errors=True)
        temporary.replace(final)
        self._record(task, rows)
        return Outcome(task.source, ok, len(rows) - ok)

    def _record(self, task: Task, rows: list[dict[str, Any]]) -> None:
        own = {"source": task.source, "source_sha256": task.digest, "copies": list(task.copies)}
        self._manifest.write(part_path(self._plan.out, task), [own | row for row in rows])


def part_path(out: Path, task: Task) -> Path:
    """A source's part of the manifest: once it is there, all is done that is to be."""
    return out / MANIFEST / f"{task.name}.parquet"
