"""The app factory: settings in, an ASGI app out."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from importlib.metadata import version

import anyio
from fastapi import FastAPI
from threadpoolctl import threadpool_limits

from service.api import categories, edit, infer, meshes, openapi, probes, problems, sliders, viewer
from service.api.body_limit import BodyLimit
from service.api.context import Context
from service.api.hangup import can_listen, reload_on_hangup
from service.api.head import Head
from service.api.quota import cpu_count
from service.api.readiness import Readiness
from service.api.store import MeshStore
from service.api.trace import Trace
from service.api.workers import Workers
from service.encode.catalog import Catalog
from service.encode.model import SHIPPED, load_models
from service.settings import Settings


def create_app(settings: Settings | None = None) -> FastAPI:
    """The service; its models are loaded when it starts, not here.

    Args:
        settings: by default those of the environment.
    """
    settings = settings or Settings()
    # Requests run side by side and their matrices are small: threads inside BLAS only contend.
    threadpool_limits(1, user_api="blas")
    app = FastAPI(
        title="Shape parameters",
        summary="Semantic editing of your own 3D shapes",
        version=version("shape-parameters"),
        generate_unique_id_function=lambda route: route.name,
        lifespan=_lifespan,
    )
    app.state.context = _context(settings)
    app.add_middleware(Head)
    app.add_middleware(BodyLimit, limit=settings.max_upload_bytes)
    app.add_middleware(Trace)  # added last: outermost
    problems.install(app)
    for noun in (infer, edit, sliders, categories, meshes, probes, viewer):
        app.include_router(noun.router)
    app.openapi = partial(openapi.document, app)  # type: ignore[method-assign]
    return app


def _context(settings: Settings) -> Context:
    cpus = cpu_count()
    workers = settings.workers or cpus
    # Each worker's inference gets its share of the CPUs.
    threads = max(1, cpus // workers)
    body = settings.body_model
    shipped = partial(load_models, SHIPPED, threads, body)
    catalog = Catalog(shipped, settings.models_dir, threads, body)
    pool = Workers(workers, settings.deadline_seconds)
    return Context(MeshStore(settings.mesh_cache_bytes), Readiness(catalog.load, pool), pool)


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    """Listen at once; the models load meanwhile, and `/readyz` tells when they are there."""
    context: Context = app.state.context
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(context.readiness.start)
        if can_listen():
            tasks.start_soon(reload_on_hangup, context.readiness)
        yield
        tasks.cancel_scope.cancel()
