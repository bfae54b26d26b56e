"""Which route a path belongs to, also where a request never gets there."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cached_property

from fastapi.routing import iter_route_contexts
from starlette.routing import BaseRoute, Route

UNMATCHED = "unmatched"
"""What is no path of the service."""

PROBES = frozenset({"/livez", "/metrics", "/readyz"})
"""Routes that machines ask every few seconds: of no interest but to who debugs them."""


def methods_of(routes: Sequence[BaseRoute], path: str) -> set[str]:
    """All that a path may be asked for, over all routes that it is of."""
    found = (context.original_route for context in iter_route_contexts(routes))
    own = [route for route in found if isinstance(route, Route) and route.path_regex.match(path)]
    methods = {method for route in own for method in route.methods or ()}
    return methods | ({"HEAD"} if "GET" in methods else set())


class Routes:
    """The templates of an app's paths; they are few, whatever clients ask for."""

    def __init__(self, routes: Sequence[BaseRoute]) -> None:
        """`routes` may grow until the first look."""
        self._routes = routes

    @cached_property
    def _literal(self) -> frozenset[str]:
        return frozenset(path for path, _ in self._templates if "{" not in path)

    @cached_property
    def _variable(self) -> list[tuple[str, re.Pattern[str]]]:
        return [(path, regex) for path, regex in self._templates if "{" in path]

    @cached_property
    def _templates(self) -> list[tuple[str, re.Pattern[str]]]:
        found = (context.original_route for context in iter_route_contexts(self._routes))
        return [(route.path, route.path_regex) for route in found if isinstance(route, Route)]

    def template(self, path: str) -> str:
        """The template that a path is of, such as ``/meshes/{mesh_id}``, or `UNMATCHED`."""
        if path in self._literal:
            return path
        return next((name for name, regex in self._variable if regex.match(path)), UNMATCHED)
