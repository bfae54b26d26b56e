"""The commands' work done by a service elsewhere, through its client."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import click
from pydantic import BaseModel

from service.cli.clientfaults import told
from service.cli.meshes import Mesh
from service.cli.shapes import Count, Made, Options
from service.client import Mesh as Sent
from service.client import ShapeClient
from service.client.errors import MeshUnknown

Tell = Callable[[str], None]


class Remote:
    """Has it done; see `Shapes`."""

    def __init__(self, url: str, api_key: str | None) -> None:
        """
        Args:
            url: of the service.
            api_key: that it wants; None for none.
        """
        try:
            self.client = ShapeClient(url, api_key)
        except ValueError as error:
            raise click.UsageError(f"--url or --api-key: {error}.") from error
        self.tell: Tell = lambda _: None

    def infer(self, mesh: Mesh, reading: Options) -> dict[str, Any]:
        with told():
            return document(self.client.infer(_sent(mesh), **self._how(reading)))

    def edit(
        self, mesh: Mesh, reading: Options, edits: Options, constraints: Options, how: Options
    ) -> Made:
        options = {**reading, **how}
        if constraints:
            options["constraints"] = _text(constraints)
        given, wanted = _sent(mesh), _text(edits)
        with told():
            report = self.client.edit_report(given, wanted, **self._how(options))
            try:
                made = self.client.mesh(report.mesh_id, **self._how({}))
            except MeshUnknown:  # the service keeps nothing, or had no room
                made = self.client.edit(given, wanted, **self._how(options))
        return Made(made.data, _format(made.filename), document(report))

    def sliders(self, mesh: Mesh, reading: Options, offer: Options) -> bytes:
        with told():
            return self.client.sliders(_sent(mesh), **self._how({**reading, **offer})).data

    def template(self, mesh: Mesh, reading: Options, offer: Options) -> bytes:
        with told():
            return self.client.template(_sent(mesh), **self._how({**reading, **offer})).data

    def transfer(
        self, source: Mesh, target: Mesh, reading: Options, target_reading: Options, how: Options
    ) -> Made:
        beside = {f"target_{name}": target_reading[name] for name in ("up", "front", "units")}
        options = {**reading, **beside, **how}
        meshes = _sent(source), _sent(target)
        with told():
            report = self.client.transfer_report(*meshes, **self._how(options))
            try:
                made = self.client.mesh(report.mesh_id, **self._how({}))
            except MeshUnknown:
                made = self.client.transfer(*meshes, **self._how(options))
        return Made(made.data, _format(made.filename), document(report))

    def categories(self) -> list[dict[str, Any]]:
        with told():
            return [document(entry) for entry in self.client.categories()]

    def category(self, name: str) -> dict[str, Any]:
        with told():
            return document(self.client.category(name))

    def augment(
        self,
        directory: Path,
        out: Path,
        reading: Options,
        how: Options,
        options: Options,
        tell: Count,
    ) -> dict[str, Any]:
        from service.cli.remotebatch import Batch

        wanted = {name: options[name] for name in ("count", "seed", "strength")}
        if how["strict"] or options["engine"] != "local" or options["shard"] != "1/1":
            raise click.UsageError("--strict, --engine and --shard are not for a service at --url.")
        form = {name: value for name, value in how.items() if name != "strict"}
        batch = Batch(self.client, out, {**reading, **form, **wanted}, options["deadline_s"])
        return batch.run(directory, options["workers"] or 2, options["force"], tell)

    def _how(self, options: Options) -> dict[str, Any]:
        """The options, and who is told how far a file has come."""
        return {
            **options,
            "progress": self._progress("up"),
            "download_progress": self._progress("down"),
        }

    def _progress(self, way: str) -> Callable[[int, int | None], None]:
        def progress(done: int, total: int | None) -> None:
            share = f"{100 * done / total:.0f} %" if total else f"{done:,} bytes"
            self.tell(f"{way} {share}")

        return progress


def document(answer: BaseModel) -> dict[str, Any]:
    """An answer's JSON as it came."""
    return answer.model_dump(mode="json", by_alias=True, exclude_unset=True)


def _sent(mesh: Mesh) -> Sent:
    return Sent(mesh.data, mesh.name)


def _text(entries: Mapping[str, Any]) -> str:
    """Entries as JSON, unread: what is wrong with them the service tells."""
    import json

    return json.dumps(dict(entries))


def _format(filename: str) -> str:
    return filename.rpartition(".")[2].lower()
