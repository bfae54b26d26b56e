"""Variants of a folder's meshes by a service elsewhere: a job a mesh, its zip unpacked."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from service.augment.plan import DIGITS
from service.augment.sources import find_files, find_tasks
from service.cli import problem
from service.cli.clientfaults import told
from service.cli.meshes import read
from service.cli.neighbours import members
from service.cli.problem import UNREACHABLE, Problem
from service.cli.shapes import Count
from service.client import Mesh, ShapeClient
from service.client.models import Job

RECORD = "asked.json"
"""In each mesh's folder: what its variants were made with."""


@dataclass(frozen=True)
class Batch:
    """What is to be made of each mesh.

    Attributes:
        client: of the service.
        out: the folder to write to.
        options: of `POST /augment`.
        deadline_s: seconds to wait for one mesh.
    """

    client: ShapeClient
    out: Path
    options: dict[str, Any]
    deadline_s: float

    def run(self, directory: Path, workers: int, force: bool, tell: Count) -> dict[str, Any]:
        """Make the variants; what is done already is kept.

        Args:
            directory: where meshes are.
            workers: jobs at once.
            force: do again what is done.
            tell: as `Shapes.augment` has it.

        Returns:
            What a batch on this machine tells.

        Raises:
            Problem: for a folder without meshes, and when the service can't be reached.
        """
        start = time.monotonic()
        with problem.told():
            files = find_files(directory, self.out)
            found = find_tasks(directory, files, "1/1", lambda: None)
        tasks = {self.out / f"{one.path.stem}-{one.digest[:DIGITS]}": one.path for one in found}
        left = {folder: file for folder, file in tasks.items() if force or not self._kept(folder)}
        kept, rows, failures = len(tasks) - len(left), [], []
        for done, (file, made) in enumerate(_each(workers, self._make, left), start=kept + 1):
            if isinstance(made, Problem):
                name = file.relative_to(directory).as_posix()
                failures.append({"file": name, "code": made.code, "detail": made.detail})
            else:
                rows += made
            tell(done, len(tasks), len(failures))
        ok = sum(row.get("problem") is None for row in rows)
        return {
            "out": str(self.out), "sources": len(tasks), "copies": len(files) - len(tasks),
            "kept": kept, "done": len(left), "failed": len(failures), "ok": ok,
            "rejected": len(rows) - ok, "failures": failures, "seconds": time.monotonic() - start,
        }  # fmt: skip

    def _kept(self, folder: Path) -> bool:
        try:
            return bool(json.loads((folder / RECORD).read_text("utf-8")) == self.options)
        except (OSError, ValueError):
            return False

    def _make(self, folder: Path, file: Path) -> list[dict[str, Any]]:
        """Rows of the variants' manifest, once all of it is there."""
        mesh = read(str(file))
        # The same mesh and options make the same job, also when a run is begun again.
        told_key = json.dumps([folder.name, self.options], sort_keys=True)
        key = hashlib.sha256(told_key.encode()).hexdigest()
        temporary = folder.with_name(f".{folder.name}.{os.getpid()}")
        with told():
            sent = Mesh(mesh.data, mesh.name)
            job = self.client.submit_augment(sent, idempotency_key=key, **self.options)
            end = self.client.wait(job, timeout=self.deadline_s)
            if end.status != "succeeded":
                raise _unmade(end)
            archive = self.client.result(end)
        shutil.rmtree(temporary, ignore_errors=True)
        for name, data in members(archive.data):
            (temporary / name).parent.mkdir(parents=True, exist_ok=True)
            (temporary / name).write_bytes(data)
        (temporary / RECORD).write_text(json.dumps(self.options), "utf-8")
        shutil.rmtree(folder, ignore_errors=True)
        temporary.replace(folder)
        return archive.manifest


def _unmade(job: Job) -> Problem:
    told = job.problem or {}
    code, detail = (
        told.get("code", f"job_{job.status}"),
        told.get("detail", f"{job.id} is {job.status}."),
    )
    return Problem(code, detail, told.get("suggestion", "Run the command again."))


Work = Callable[[Path, Path], list[dict[str, Any]]]


def _each(
    workers: int, work: Work, tasks: dict[Path, Path]
) -> Iterator[tuple[Path, list[dict[str, Any]] | Problem]]:
    """What becomes of each file, as it comes; ended at once where the service is gone."""
    with ThreadPoolExecutor(workers) as pool:
        running: dict[Future[list[dict[str, Any]]], Path] = {
            pool.submit(work, folder, file): file for folder, file in tasks.items()
        }
        try:
            while running:
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    file = running.pop(future)
                    try:
                        yield file, future.result()
                    except Problem as fault:
                        if fault.exit_code == UNREACHABLE:
                            raise
                        yield file, fault
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
