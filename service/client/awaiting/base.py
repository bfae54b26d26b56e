"""What carries out each call, to await."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

from service.client import calls
from service.client.call import Answer, Call, Sending
from service.client.config import Config
from service.client.drivers import AsyncDriver
from service.client.exchange import exchange
from service.client.mesh import MeshLike

T = TypeVar("T")


class Caller:
    """Carries out calls."""

    _config: Config
    _driver: AsyncDriver

    async def request(self, call: Call[T]) -> T:
        """Carry out any call; the methods here are each one of `service.client.calls`.

        Args:
            call: what is sent, and how the answer is read.

        Raises:
            ServiceError: see `service.client.errors`.
        """
        return await self._driver.run(exchange(call, self._config))

    async def post(
        self,
        path: str,
        fields: Mapping[str, str] | Sequence[tuple[str, str]] = (),
        files: Mapping[str, MeshLike] | Sequence[tuple[str, MeshLike]] = (),
        headers: Mapping[str, str] | None = None,
        method: str = "POST",
    ) -> Answer:
        """A form as it stands: what no method here would send.

        Args:
            path: with a slash at its beginning.
            fields, files: of the form; pairs where a name repeats.  Files go whole.
            headers: beside the client's own.
            method: only a POST has a body.

        Returns:
            Status, headers and content of a success.

        Raises:
            ServiceError: as of every call.
        """
        return await self.request(calls.plain(method, path, fields, files, headers, Sending()))
