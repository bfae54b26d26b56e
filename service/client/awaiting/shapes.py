"""What is made of meshes, to await."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Unpack

from service.client import calls
from service.client.awaiting.base import Caller
from service.client.files import Archive, Edited, File
from service.client.mesh import MeshLike
from service.client.models import EditReport, InferReport, TransferReport
from service.client.options import (
    Augmenting,
    Editing,
    EditingReport,
    Offering,
    Reading,
    Transferring,
    TransferringReport,
    VaryingEdits,
)
from service.client.values import Values


class ShapeCalls(Caller):
    """What is made of meshes, at once."""

    async def infer(self, mesh: MeshLike, **options: Unpack[Reading]) -> InferReport:
        """What the parameters of a mesh are.

        Args:
            mesh: what to read; a `Mesh` learns its id, and later calls send but that.
            options: `Reading`: category, up, front, units, refine; `How`.

        Returns:
            The parameters with standard deviations, the dimensions that follow, and the fit.

        Raises:
            NotRecognised: when it is of no known category.
            ServiceError: see `service.client.errors`.
        """
        return await self.request(calls.infer(mesh, options))

    async def edit(
        self, mesh: MeshLike, edits: Values | str | None = None, **options: Unpack[Editing]
    ) -> Edited:
        """The same file with its parameters changed.

        Args:
            mesh: what to edit.
            edits: by name `scale(1.2)`, `add(0.05)`, `set_to(0.45)`, the like as plain dicts, or a
                number, which sets.  None where there are constraints.
            options: `Editing`: constraints, mode, keep, format, strict, to; those of `infer`.

        Returns:
            The file, and the parameters' values after the edit.

        Raises:
            ConstraintsConflict: when constraints contradict each other.
            ServiceError: see `service.client.errors`.
        """
        return await self.request(calls.edit(mesh, edits, options))

    async def edit_report(
        self, mesh: MeshLike, edits: Values | str | None = None, **options: Unpack[EditingReport]
    ) -> EditReport:
        """What would become of a mesh by an edit; the edited one is kept under its `mesh_id`.

        Args:
            mesh, edits: as of `edit`.
            options: those of `edit` but `to`.

        Returns:
            The values before and after; `mesh(report.mesh_id)` is the edited file.

        Raises:
            ServiceError: as `edit`.
        """
        return await self.request(calls.edit_report(mesh, edits, options))

    async def edit_variants(
        self,
        mesh: MeshLike,
        variants: Sequence[Values] | str,
        **options: Unpack[VaryingEdits],
    ) -> Archive:
        """Many edits of one mesh.

        Args:
            mesh: what to edit.
            variants: 1 to 1000 of what `edit` takes as edits.
            options: `VaryingEdits`: mode, keep, format, strict, to; those of `infer`.

        Returns:
            A zip; its manifest has a row a variant, also for those that could not be made.

        Raises:
            ServiceError: see `service.client.errors`.
        """
        return await self.request(calls.edit_variants(mesh, variants, options))

    async def sliders(self, mesh: MeshLike, **options: Unpack[Offering]) -> File:
        """A GLB of the mesh that any viewer edits, with a slider a parameter.

        Args:
            mesh: what to put them into.
            options: `Offering`: parameters, keep, paired, quantize, joint_names, rest, to; those of
                `infer`.

        Raises:
            ServiceError: see `service.client.errors`.
        """
        return await self.request(calls.made("/sliders", mesh, options))

    async def template(self, mesh: MeshLike, **options: Unpack[Offering]) -> File:
        """A GLB of what was fitted to the mesh, in the mesh's place, with the same sliders.

        Args:
            mesh, options: as of `sliders`.

        Raises:
            ServiceError: see `service.client.errors`.
        """
        return await self.request(calls.made("/template", mesh, options))

    async def transfer(
        self, source: MeshLike, target: MeshLike, **options: Unpack[Transferring]
    ) -> Edited:
        """The source's file with the parameters of the target.

        Args:
            source: what to edit.
            target: what to take the parameters from; of the same category.
            options: `Transferring`: parameters, size, position, target_up, target_front,
                target_units, mode, keep, format, strict, to; those of `infer`, for the source.

        Returns:
            The file, and the parameters' values after the edit.

        Raises:
            CategoriesDiffer: when they are of two categories.
            ServiceError: see `service.client.errors`.
        """
        return await self.request(calls.transfer(source, target, options))

    async def transfer_report(
        self, source: MeshLike, target: MeshLike, **options: Unpack[TransferringReport]
    ) -> TransferReport:
        """What a transfer makes of the source; the edited mesh is kept under its `mesh_id`.

        Args:
            source, target: as of `transfer`.
            options: those of `transfer` but `to`.

        Raises:
            ServiceError: as `transfer`.
        """
        return await self.request(calls.transfer_report(source, target, options))

    async def augment(self, mesh: MeshLike, **options: Unpack[Augmenting]) -> Archive:
        """Random variants of a mesh, for training data.

        Args:
            mesh: what to vary.
            options: `Augmenting`: count, seed, strength, mode, keep, format, to; those of `infer`.

        Returns:
            A zip of the variants, with a manifest and the part of each vertex.

        Raises:
            ServiceError: see `service.client.errors`.
        """
        return await self.request(calls.augment(mesh, options))
