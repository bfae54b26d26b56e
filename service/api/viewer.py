"""GET / and /docs: pages that use this service from a browser; and GET /web/...: their files."""

from __future__ import annotations

import base64
import gzip
import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from anyio import to_thread
from fastapi import APIRouter, Request
from starlette.exceptions import HTTPException
from starlette.responses import Response

from service.api.etags import held, not_modified, strong

FOLDER = Path(__file__).parents[1] / "web"

MEDIA_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".webp": "image/webp",
    ".glb": "model/gltf-binary",
}
"""What is served; anything else in the folder is not."""

# The names of vendored folders carry a version: what they hold never changes.
_FOREVER = "public, max-age=31536000, immutable"
_REVALIDATED = "no-cache"

_POLICY = (
    "default-src 'none'; script-src 'self' {scripts}; style-src 'self'; "
    "img-src 'self' blob: data:; "
    # The textures of a mesh are decoded from blobs.
    "connect-src 'self' blob:; manifest-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_PAGES_ALONE = {
    "Cross-Origin-Opener-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=(), payment=(), usb=()",
}

router = APIRouter(include_in_schema=False)


@dataclass(frozen=True)
class Page:
    """A file of the pages, ready to be sent.

    Attributes:
        plain, packed: its bytes, as they are and by gzip; None where that is no gain.
        digest: of the bytes.
        headers: of every answer with it.
    """

    plain: bytes
    packed: bytes | None
    digest: str
    headers: Mapping[str, str]


@cache
def pages() -> dict[str, Page]:
    """Every file that is served, by its path in the folder; a request can name no other."""
    found = (path for path in sorted(FOLDER.rglob("*")) if path.suffix in MEDIA_TYPES)
    return {path.relative_to(FOLDER).as_posix(): _page(path) for path in found}


@router.get("/")
async def viewer(request: Request) -> Response:
    return await _answer(request, "index.html")


@router.get("/docs")
async def docs(request: Request) -> Response:
    return await _answer(request, "docs.html")


@router.get("/web/{path:path}")
async def static(request: Request, path: str) -> Response:
    return await _answer(request, path)


def _page(path: Path) -> Page:
    plain = path.read_bytes()
    packed = gzip.compress(plain, 6, mtime=0)
    vendored = "vendor" in path.relative_to(FOLDER).parts
    headers = {
        "Content-Type": MEDIA_TYPES[path.suffix],
        "Cache-Control": _FOREVER if vendored else _REVALIDATED,
        "Vary": "Accept-Encoding",
    }
    if path.suffix == ".html":
        headers |= _PAGES_ALONE
        headers["Content-Security-Policy"] = _POLICY.format(scripts=_inline_scripts(plain.decode()))
    smaller = len(packed) < 0.9 * len(plain)
    digest = hashlib.sha256(plain).hexdigest()[:32]
    return Page(plain, packed if smaller else None, digest, headers)


def _inline_scripts(html: str) -> str:
    """The digests by which a policy allows a page's inline scripts: its import map."""
    scripts = re.findall(r"<script type=\"importmap\">(.*?)</script>", html, re.DOTALL)
    digests = (hashlib.sha256(script.encode()).digest() for script in scripts)
    return " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)


async def _answer(request: Request, name: str) -> Response:
    # Packing them takes half a second, the first time.
    page = (await to_thread.run_sync(pages)).get(name)
    if page is None:
        raise HTTPException(404)
    packs = page.packed is not None and _takes_gzip(request.headers.get("accept-encoding", ""))
    # The two encodings are two representations: strong tags must differ.
    suffix = "-gzip" if packs else ""
    tag = strong(f"{page.digest}{suffix}")
    if held(request, tag):
        return not_modified(tag, page.headers)
    headers = {**page.headers, "ETag": tag}
    if packs:
        return Response(page.packed, headers={**headers, "Content-Encoding": "gzip"})
    return Response(page.plain, headers=headers)


def _takes_gzip(accept_encoding: str) -> bool:
    for entry in accept_encoding.lower().split(","):
        coding, _, weight = entry.partition(";")
        if coding.strip() == "gzip":
            return weight.replace(" ", "") not in ("q=0", "q=0.0", "q=0.00", "q=0.000")
    return False
