"""What the service knows and keeps, to await."""

from __future__ import annotations

from typing import Unpack

from service.client import calls
from service.client.awaiting.base import Caller
from service.client.files import File
from service.client.mesh import Mesh
from service.client.models import Alive, Category, Ready
from service.client.options import How, Saving


class ServedCalls(Caller):
    """What the service knows and keeps."""

    async def categories(self, **options: Unpack[How]) -> list[Category]:
        """What can be edited, with all parameters.

        Raises:
            ServiceError: see `service.client.errors`.
        """
        return (await self.request(calls.categories(options))).categories

    async def category(self, name: str, **options: Unpack[How]) -> Category:
        """One category.

        Args:
            name: such as `chair`, or `chair@1.0.0` for one version of its model.

        Raises:
            CategoryUnknown: when there is none.
            ServiceError: see `service.client.errors`.
        """
        return await self.request(calls.category(name, options))

    async def mesh(self, mesh_id: str | Mesh, **options: Unpack[Saving]) -> File:
        """A mesh that the service keeps, byte for byte.

        Args:
            mesh_id: as a report named it, or a `Mesh` that knows its own.
            options: `Saving`: to; `How`.

        Raises:
            MeshUnknown: when it is not kept any more.
            ServiceError: see `service.client.errors`.
        """
        return await self.request(calls.mesh(mesh_id, options))

    async def ready(self, **options: Unpack[How]) -> Ready:
        """Which models are served; waits as long as retries go where they still load.

        Raises:
            Unavailable: when it is not ready by then.
            ServiceError: see `service.client.errors`.
        """
        return await self.request(calls.ready(options))

    async def alive(self, **options: Unpack[How]) -> Alive:
        """Whether the service runs at all.

        Raises:
            ServiceError: see `service.client.errors`.
        """
        return await self.request(calls.alive(options))
