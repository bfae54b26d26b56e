"""Whom a client calls, as whom, and how patiently."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import PackageNotFoundError, version

import httpx

from service.client.retry import Retry

URL = "http://127.0.0.1:8000"

TIMEOUT = httpx.Timeout(connect=10.0, write=60.0, read=120.0, pool=60.0)
"""An answer begins once the work is done, so reading may have to wait for as long as that takes."""


@dataclass(frozen=True)
class Config:
    """What all calls of a client share.

    Attributes:
        url: of the service, without a slash at its end.
        api_key: is sent to the service alone; None for none.
        timeout: of each call, unless it has its own.
        retry: likewise.
    """

    url: str
    api_key: str | None = field(repr=False)
    timeout: httpx.Timeout
    retry: Retry

    @classmethod
    def of(
        cls,
        url: str | None,
        api_key: str | None,
        timeout: float | httpx.Timeout | None,
        retry: Retry | None,
        fallback: str = "",
    ) -> Config:
        """What is given, else what the environment says in `SHAPE_URL` and `SHAPE_API_KEY`.

        Args:
            fallback: the URL of the given httpx client, which goes before the environment's.

        Raises:
            ValueError: when the URL or the key can't be one, or the two don't go together.
        """
        place = url or fallback or os.environ.get("SHAPE_URL") or URL
        key = os.environ.get("SHAPE_API_KEY") if api_key is None else api_key
        _require_sound(place, bool(key))
        if key and not (key.isascii() and key.isprintable() and " " not in key):
            raise ValueError("the API key holds characters that none has")
        patience = TIMEOUT if timeout is None else httpx.Timeout(timeout)
        return cls(place.rstrip("/"), key or None, patience, retry or Retry())

    def headers(self) -> dict[str, str]:
        """Those of every request."""
        headers = {"User-Agent": _agent()}
        if self.api_key is not None:
            headers["Authorization"] = f"Bearer {self.api_key}"
        return headers

    @property
    def shown(self) -> str:
        """The URL without what a secret could stand in."""
        return str(httpx.URL(self.url).copy_with(userinfo=b""))


def _require_sound(place: str, has_key: bool) -> None:
    try:
        url = httpx.URL(place)
    except httpx.InvalidURL as error:
        raise ValueError(f"the URL of the service is none: {error}") from error
    shown = str(url.copy_with(userinfo=b"", query=None, fragment=None))
    if url.scheme not in ("http", "https") or not url.host:
        raise ValueError(f"{shown!r} does not begin with http:// or https:// and a host")
    if url.query or url.fragment:
        raise ValueError(f"the URL of the service ends with its path, as in {shown!r}")
    if url.userinfo and has_key:
        raise ValueError(
            f"the URL of {shown!r} holds a name or password, and there is an API key: only one of "
            "them can be sent; leave the other out (an empty api_key is none)"
        )


@cache
def _agent() -> str:
    try:
        return f"shape-parameters/{version('shape-parameters')}"
    except PackageNotFoundError:
        return "shape-parameters"
