"""Entity tags: what a client says that it holds, and what it would be sent.

What is computed is tagged by what it is computed from: the content, name and type of the uploads,
the fields of the form, the `Accept` header, the models and the build of the service.  So a client
that holds an answer is told so before anything is inferred, and a large result need not be hashed.

The tags are weak.  The same request to the same build gets the same bytes on one machine, for
nothing in it is left to chance or to the clock; but replicas may run on CPUs whose vector units
round differently in the last digit, and such answers are equivalent, not identical.  Nothing is
lost by it: `If-None-Match` compares weakly, and ranges, which need strong tags, are not served.

The calls that compute are POSTs for want of a body in GET: they change nothing, so 304 means in
their answers what it does for GET.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence

from starlette.requests import Request
from starlette.responses import Response

from service.api.build import build
from service.api.forms import MeshForm
from service.encode.model import Model
from service.requests import Upload

REVALIDATED = {"Cache-Control": "private, no-cache"}
"""Headers of what is the client's own and may change with the next build."""

_TAG = re.compile(r'(?:W/)?"([\x21\x23-\x7e\x80-\xff]*)"')


def validator(
    request: Request, uploads: Sequence[Upload], form: MeshForm, models: Mapping[str, Model]
) -> str:
    """What the answer to a form depends on, as 32 hex digits: the inside of a tag.

    The first call with uploads hashes them: not for the event loop.
    """
    facts = [
        build(),
        request.url.path,
        request.headers.getlist("accept"),
        [[upload.mesh_id, upload.name, upload.content_type] for upload in uploads],
        form.model_dump(mode="json", exclude={*form.uploads, *form.uploads.values()}),
        {name: model.fingerprint for name, model in models.items()},
    ]
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()[:32]


def weak(inside: str) -> str:
    """A tag for equivalent answers."""
    return f'W/"{inside}"'


def strong(inside: str) -> str:
    """A tag for these very bytes."""
    return f'"{inside}"'


def named(request: Request) -> list[str]:
    """The insides of the tags in `If-None-Match`; nothing for ``*``.

    ``*`` asks whether there is an answer at all, which the computation alone tells: see `held`.
    """
    return _TAG.findall(_asked(request))


def held(request: Request, tag: str) -> bool:
    """Whether the client holds the answer of that tag, or any (RFC 9110, section 13.1.2)."""
    return _asked(request).strip() == "*" or tag.removeprefix("W/")[1:-1] in named(request)


def not_modified(tag: str, headers: Mapping[str, str]) -> Response:
    """304, with the headers that the whole answer would have had of those that caches mind."""
    return Response(status_code=304, headers={"ETag": tag, **headers})


def _asked(request: Request) -> str:
    return ",".join(request.headers.getlist("if-none-match"))
