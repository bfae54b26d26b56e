"""The commands' work done in this process, by the service's own pipeline."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import click
from pydantic import ValidationError
from threadpoolctl import threadpool_limits

from service import pipeline
from service.cli.meshes import Mesh
from service.cli.problem import told
from service.cli.shapes import Count, Made, Options
from service.constraints import parse_constraints
from service.edited import Edited
from service.edits import parse_edits
from service.encode.catalog import Catalog
from service.encode.installed import Installed
from service.encode.model import SHIPPED, load_models
from service.encode.versions import AT, explain_unknown
from service.errors import NotFound
from service.mesh.frame import AUTO
from service.requests import EditOptions, InferOptions, SliderOptions, TransferOptions, Upload
from service.settings import Settings

# Threads that one encoding may use: the same as on a server whose workers share its CPUs.
THREADS = 1


class Local:
    """Does it here; see `Shapes`.

    The models are loaded once they are wanted, and only those that are.
    """

    def __init__(self) -> None:
        # Matrices are small: threads inside BLAS only contend.
        threadpool_limits(1, user_api="blas")
        self.tell: Callable[[str], None] = lambda _: None

    def infer(self, mesh: Mesh, reading: Options) -> dict[str, Any]:
        with told():
            options = InferOptions(**reading)
            models = self.installed(options.category).named
            return pipeline.infer(upload(mesh), models, options).report()

    def edit(
        self, mesh: Mesh, reading: Options, edits: Options, constraints: Options, how: Options
    ) -> Made:
        with told():
            options, sent = InferOptions(**reading), upload(mesh)
            changes = parse_edits(json.dumps(dict(edits)))
            kept = parse_constraints(json.dumps(dict(constraints)))
            models = self.installed(options.category).named
            edit_options = EditOptions(**how)
            edited = pipeline.edit(sent, models, options, changes, edit_options, kept)
            return _made(edited, {"source_mesh_id": sent.mesh_id})

    def sliders(self, mesh: Mesh, reading: Options, offer: Options) -> bytes:
        with told():
            options = InferOptions(**reading)
            models = self.installed(options.category).named
            return pipeline.sliders(upload(mesh), models, options, SliderOptions(**offer))

    def template(self, mesh: Mesh, reading: Options, offer: Options) -> bytes:
        with told():
            options = InferOptions(**reading)
            models = self.installed(options.category).named
            return pipeline.template(upload(mesh), models, options, SliderOptions(**offer))

    def transfer(
        self, source: Mesh, target: Mesh, reading: Options, target_reading: Options, how: Options
    ) -> Made:
        with told():
            options, target_options = InferOptions(**reading), InferOptions(**target_reading)
            meshes = upload(source), upload(target)
            models = self.installed(options.category).named
            transfer_options = TransferOptions(**how)
            edited = pipeline.transfer(*meshes, models, options, target_options, transfer_options)
            ids = ("source_mesh_id", "target_mesh_id")
            return _made(edited, {name: m.mesh_id for name, m in zip(ids, meshes, strict=True)})

    def augment(
        self,
        directory: Path,
        out: Path,
        reading: Options,
        how: Options,
        options: Options,
        tell: Count,
    ) -> dict[str, Any]:
        from service.augment import driver
        from service.augment.plan import Models

        settings = self.settings
        models = Models(
            settings.categories,
            settings.models_dir,
            settings.body_model,
            settings.default_models,
        )
        with told():
            summary = driver.augment(
                directory,
                out,
                infer=InferOptions(**reading),
                edit=EditOptions(**how),
                models=models,
                progress=lambda done, total, _, failed: tell(done, total, failed),
                **options,
            )
        fields = ("code", "detail")
        failures = [
            {"file": name, **dict(zip(fields, why, strict=True))} for name, *why in summary.failures
        ]
        return {**asdict(summary), "out": str(out), "failures": failures}

    def categories(self) -> list[dict[str, Any]]:
        with told():
            installed = self.installed(AUTO)
            return [installed.describe(name) for name in sorted(installed.models)]

    def category(self, name: str) -> dict[str, Any]:
        with told():
            installed = self.installed(name)
            if name not in installed.named:
                detail, names = explain_unknown(installed.named, name)
                raise NotFound("unknown_category", detail, f"There are {names}.")
            return installed.describe(name)

    def installed(self, category: str) -> Installed:
        """The models that a category needs: its own, or all where it is none that is known.

        Raises:
            ModelFault: when one can't be trusted.
        """
        name = category.partition(AT)[0]
        alone = name in self.settings.categories
        return self._loaded(name if alone else None)

    @cached_property
    def settings(self) -> Settings:
        """The environment's."""
        try:
            return Settings()
        except ValidationError as error:
            told = [
                f"{str(e['loc'][0]).upper()}={e['input']!r}: {e['msg']}" for e in error.errors()
            ]
            raise click.UsageError("; ".join(told)) from error

    @cached_property
    def _kept(self) -> dict[str | None, Installed]:
        return {}

    def _loaded(self, name: str | None) -> Installed:
        whole = self._kept.get(None)
        if whole is not None:
            return whole
        if name not in self._kept:
            self._kept[name] = self._load(name)
        return self._kept[name]

    def _load(self, name: str | None) -> Installed:
        settings = self.settings
        names = settings.categories if name is None else (name,)
        defaults = {
            category: version
            for category, version in settings.default_models.items()
            if name in (None, category)
        }
        shipped = partial(load_models, SHIPPED, THREADS, settings.body_model, names)
        own = settings.models_dir, THREADS, settings.body_model, defaults
        installed = Catalog(shipped, *own).load()
        for fault in installed.faults:
            click.echo(f"Warning: {fault.detail}. {fault.suggestion}", err=True)
        if not installed.models:
            raise NotFound(
                "no_models",
                "No model is installed.",
                "Name categories that come along in CATEGORIES, or a folder in MODELS_DIR.",
            )
        return installed


def upload(mesh: Mesh) -> Upload:
    """A mesh as the pipeline takes it."""
    return Upload(mesh.data, mesh.name)


def _made(edited: Edited, ids: Options) -> Made:
    mesh_id = Upload(edited.data).mesh_id
    return Made(edited.data, edited.format, {"mesh_id": mesh_id, **ids, **edited.report})
