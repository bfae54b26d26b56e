"""The app factory: settings in, an ASGI app out."""

from __future__ import annotations

import gc
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from importlib.metadata import version
from itertools import chain

import anyio
import anyio.to_thread
from fastapi import FastAPI
from threadpoolctl import threadpool_limits

from service import malloc
from service.api import (
    augment,
    categories,
    edit,
    events,
    form_limits,
    infer,
    jobs,
    meshes,
    openapi,
    probes,
    problems,
    scrape,
    sliders,
    transfer,
    viewer,
)
from service.api.admission import Admission, Admit
from service.api.auth import Auth
from service.api.body_limit import BodyLimit
from service.api.context import Context
from service.api.cors import Cors
from service.api.cross_site import CrossSite
from service.api.failures import Failures
from service.api.framing import Framing
from service.api.hangup import can_listen, reload_on_hangup
from service.api.head import Head
from service.api.keys import Keys
from service.api.linger import Linger
from service.api.metrics import Metrics
from service.api.mirror import Mirror
from service.api.observe import Observe
from service.api.pieces import Pieces
from service.api.quota import cpu_count, memory_bytes
from service.api.readiness import Readiness
from service.api.routes import Routes
from service.api.safety import SafetyHeaders
from service.api.tracing import TELEMETRY
from service.api.workers import Workers
from service.budget import MEBIBYTE, Budget
from service.encode.catalog import Catalog
from service.encode.installed import Installed
from service.encode.model import SHIPPED, load_models
from service.inferences import Inferences
from service.jobs.jobs import Jobs
from service.jobs.runner import Runner, Surroundings
from service.jobs.store import Bounds, JobStore
from service.origins import ALL
from service.settings import Settings
from service.store.meshstore import MeshStore, open_store

TRIM_EVERY_S = 10.0
JOBS_FOLDER = "jobs"
JOBS_BYTES = 1024 * MEBIBYTE
"""On a disk, by default."""


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
        form_limits={
            "max_fields": form_limits.FIELDS,
            "max_files": form_limits.FILES,
            "max_part_size": form_limits.FIELD_BYTES,
        },
        # The page at /docs is our own: FastAPI's loads its parts from elsewhere.
        docs_url=None,
        redoc_url=None,
        # To send a client elsewhere is to trust its Host header, and to have its key sent there.
        redirect_slashes=False,
        telemetry=TELEMETRY,
    )
    keys = Keys(settings.api_keys.get_secret_value(), settings.api_keys_file)
    app.state.context = _context(settings)
    app.state.keys = keys
    app.add_middleware(Admit, admission=app.state.context.admission)
    app.add_middleware(BodyLimit, limit=settings.max_upload_bytes, seconds=settings.body_seconds)
    app.add_middleware(Auth, keys=keys)
    app.add_middleware(Framing)
    if ALL not in settings.cors_origins:
        app.add_middleware(CrossSite, origins=settings.cors_origins)
    app.add_middleware(Head)
    app.add_middleware(Failures)
    if settings.cors_origins:
        app.add_middleware(Cors, origins=settings.cors_origins)
    app.add_middleware(SafetyHeaders)
    metrics = app.state.context.metrics
    metrics.registry.register(Mirror(app.state.context))
    app.add_middleware(Observe, metrics=metrics, routes=Routes(app.routes))
    app.add_middleware(Pieces)
    app.add_middleware(Linger)  # added last: outermost
    problems.install(app)
    for noun in (infer, edit, sliders, transfer, augment):
        app.include_router(noun.router, responses=problems.documented(401, 403))
    for noun in (categories, meshes, jobs, events):
        app.include_router(noun.router, responses=problems.documented(401))
    for noun in (probes, scrape, viewer):
        app.include_router(noun.router)
    app.openapi = partial(openapi.document, app)  # type: ignore[method-assign]
    return app


def _context(settings: Settings) -> Context:
    cpus = cpu_count()
    workers = settings.workers or cpus
    # Each worker's inference gets its share of the CPUs.
    threads = max(1, cpus // workers)
    body = settings.body_model
    shipped = partial(load_models, SHIPPED, threads, body, settings.categories)
    catalog = Catalog(shipped, settings.models_dir, threads, body, settings.default_models)
    budget = Budget(memory_bytes())
    meshes_held = budget.share(settings.mesh_cache_bytes)
    inferences_held = budget.share(settings.inference_cache_bytes)
    bodies_held = budget.share(settings.max_pending_bytes)
    held = meshes_held + inferences_held + bodies_held
    kept = _store(settings, meshes_held)
    job_store = _job_store(settings, budget)
    if not job_store.durable:
        held += job_store.bounds.bytes
    vertices = settings.max_vertices or budget.vertices(workers, held)
    pool = Workers(workers, settings.deadline_seconds, vertices)
    queue = max(1, workers // 2) if settings.queue is None else settings.queue
    admission = Admission(pool, queue, bodies_held)
    inferences = Inferences(inferences_held)

    def load() -> Installed:
        installed = catalog.load()
        inferences.retain(chain(*installed.versions.values()))
        _freeze()
        return installed

    readiness = Readiness(load)
    around = Surroundings(
        lambda: readiness.installed.named,
        inferences,
        settings.deadline_seconds,
        vertices,
        lambda: pool.queued > 0 or pool.working >= pool.count,
        lambda: readiness.draining,
    )
    jobs = Jobs(job_store, Runner(job_store, around))
    return Context(kept, inferences, readiness, pool, admission, Metrics(), jobs)


def _job_store(settings: Settings, budget: Budget) -> JobStore:
    folder = settings.jobs_dir
    if folder is None and settings.store_dir is not None:
        folder = settings.store_dir / JOBS_FOLDER
    most = settings.jobs_bytes or (budget.jobs if folder is None else JOBS_BYTES)
    return JobStore(folder, Bounds(settings.jobs, most, settings.job_seconds))


def _freeze() -> None:
    """Leave out of full garbage collections what is here to stay: each stops all threads, for 50 to
    100 ms if it looks at every module and model."""
    gc.unfreeze()
    gc.collect()
    gc.freeze()


def _store(settings: Settings, memory_bytes: int) -> MeshStore:
    url = settings.store_url.get_secret_value() if settings.store_url else None
    return open_store(memory_bytes, settings.store_dir, settings.store_bytes, url)


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    """Listen at once; the models load meanwhile, and `/readyz` tells when they are there."""
    context: Context = app.state.context
    app.state.keys.announce()
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(context.readiness.start)
        if can_listen():
            tasks.start_soon(reload_on_hangup, context.readiness, app.state.keys)
        tasks.start_soon(_trim_after_work, context.workers)
        if context.jobs.store.durable:
            context.jobs.start()
        yield
        await anyio.to_thread.run_sync(context.jobs.close)
        context.store.close()
        tasks.cancel_scope.cancel()


async def _trim_after_work(workers: Workers) -> None:
    """Now and then give the memory back that requests have left free, if there were any."""
    seen = workers.pace
    while True:
        await anyio.sleep(TRIM_EVERY_S)
        if workers.pace != seen:
            seen = workers.pace
            await anyio.to_thread.run_sync(malloc.trim)
