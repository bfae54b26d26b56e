"""What the service holds at the moment, read when metrics are asked for: so it can't drift."""

from __future__ import annotations

import platform
from collections.abc import Iterable, Iterator, Sequence
from importlib.metadata import version

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from service.api.context import Context
from service.api.metrics import PREFIX
from service.encode.installed import Installed
from service.errors import ShapeError
from service.jobs.job import STATUSES
from service.jobs.order import KINDS

Rows = Iterable[tuple[Sequence[str], float]]

_BUILD = (version("shape-parameters"), version("onnxruntime"), platform.python_version())


class Mirror(Collector):
    """A collector over the context of an app, for the event loop's thread."""

    def __init__(self, context: Context) -> None:
        self._context = context

    def collect(self) -> Iterator[Metric]:
        """The families, each with its help."""
        build = ("version", "onnxruntime", "python")
        yield _gauge("build_info", "Which build this is; always 1.", build, [(_BUILD, 1)])
        yield from self._work()
        yield from self._models()
        yield from self._store()
        yield from self._inferences()
        yield from self._jobs()

    def _work(self) -> Iterator[Metric]:
        workers, admission = self._context.workers, self._context.admission
        yield _one("workers", "Threads that infer and edit.", workers.count)
        yield _one("working_requests", "Requests that a worker works on.", workers.working)
        yield _one("queue_requests", "Requests that wait for a worker.", workers.queued)
        yield _one("admitted_requests", "Requests that hold a place.", admission.held)
        yield _one("admission_places", "Places in work and in queue.", admission.places)
        yield _one("pending_bytes", "Bodies that are held, or on their way.", admission.held_bytes)
        yield _one("pending_limit_bytes", "What of them is held at most.", admission.most_bytes)
        yield _counter(
            "admission_rejections",
            "Requests answered with 429, by what there was no room for.",
            ("reason",),
            [((reason,), count) for reason, count in admission.rejected.items()],
        )

    def _models(self) -> Iterator[Metric]:
        readiness = self._context.readiness
        try:
            installed = readiness.installed
        except ShapeError:
            installed = Installed({})
        serves = bool(installed.models)
        yield _one("ready", "Whether new requests are welcome.", serves and not readiness.draining)
        yield _one("draining", "Whether the service is about to stop.", readiness.draining)
        yield _gauge(
            "model_info",
            "A model that is served; always 1.",
            ("category", "version", "digest", "default"),
            [
                (
                    (name, model.version, model.digest, _told(installed.models[name] is model)),
                    1,
                )
                for name, models in installed.versions.items()
                for model in models
            ],
        )
        yield _one("faulty_models", "Models that can't be served.", len(installed.faults))
        yield _counter(
            "model_reloads",
            "Times that the models were loaded anew, by how it went.",
            ("result",),
            [((result,), count) for result, count in readiness.reloads.items()],
        )

    def _store(self) -> Iterator[Metric]:
        store, tier = self._context.store, ("tier",)
        sized = [(t.name, t) for t in (store.memory, store.disk) if t is not None]
        kept = {
            "store_bytes": ("What kept meshes take.", [t.size for _, t in sized]),
            "store_limit_bytes": ("What they may take.", [t.capacity for _, t in sized]),
            "store_meshes": ("Meshes that are kept.", [t.entries for _, t in sized]),
        }
        for name, (help, values) in kept.items():
            rows = [((t,), value) for (t, _), value in zip(sized, values, strict=True)]
            yield _gauge(name, help, tier, rows)
        tallies = [(t.name, t.tally) for t in store.tiers]
        hits = [((name,), tally.hits) for name, tally in tallies]
        yield _counter("store_hits", "Meshes found in a tier.", tier, hits)
        misses = [((name,), tally.misses) for name, tally in tallies]
        yield _counter("store_misses", "Meshes not found in a tier.", tier, misses)
        evictions = [((name,), tally.evictions) for name, tally in tallies]
        yield _counter("store_evictions", "Meshes that made room for others.", tier, evictions)
        yield _counter(
            "store_failures",
            "What went wrong in a tier: it could not be read or written, or held what was not "
            "stored.",
            ("tier", "kind"),
            [
                ((name, kind), count)
                for name, tally in tallies
                for kind, count in (
                    ("read", tally.read_failures),
                    ("write", tally.write_failures),
                    ("corrupted", tally.corrupted),
                )
            ],
        )

    def _inferences(self) -> Iterator[Metric]:
        known = self._context.inferences
        yield _one("inference_cache_bytes", "What kept inferences take.", known.size)
        yield _one("inference_cache_limit_bytes", "What they may take.", known.capacity)
        yield _one("inference_cache_entries", "Inferences that are kept.", len(known))
        hits = "Requests whose mesh was known, or just being looked at."
        yield _counter("inference_cache_hits", hits, (), [((), known.hits)])
        misses = "Requests whose mesh had to be looked at."
        yield _counter("inference_cache_misses", misses, (), [((), known.misses)])

    def _jobs(self) -> Iterator[Metric]:
        jobs = self._context.jobs
        counts, taken = jobs.store.counts()
        rows = [((status,), counts[status]) for status in STATUSES]
        yield _gauge("jobs", "Jobs that are kept, by status.", ("status",), rows)
        yield _one("jobs_bytes", "What jobs and results take, or may come to.", taken)
        yield _one("jobs_limit_bytes", "What they may take.", jobs.store.bounds.bytes)
        yield _one("job_streams", "Clients that are told of jobs by events.", jobs.streams)
        made, ended = jobs.runner.made, jobs.runner.ended
        yield _counter(
            "job_variants",
            "Variants that jobs came to, by whether they could be made.",
            ("kind", "result"),
            [((k, r), made[k, r]) for k in KINDS for r in ("ok", "failed")],
        )
        yield _counter(
            "jobs_ended",
            "Jobs that were carried out, by how that went.",
            ("kind", "status"),
            [((k, s), ended[k, s]) for k in KINDS for s in ("succeeded", "failed")],
        )
        yield _counter(
            "job_faults", "Times that the database failed.", (), [((), jobs.store.faults)]
        )


def _one(name: str, help: str, value: float) -> Metric:
    return _gauge(name, help, (), [((), value)])


def _gauge(name: str, help: str, labels: Sequence[str], rows: Rows) -> Metric:
    family = GaugeMetricFamily(f"{PREFIX}_{name}", help, labels=labels)
    for values, value in rows:
        family.add_metric(values, value)
    return family


def _counter(name: str, help: str, labels: Sequence[str], rows: Rows) -> Metric:
    family = CounterMetricFamily(f"{PREFIX}_{name}", help, labels=labels)
    for values, value in rows:
        family.add_metric(values, value)
    return family


def _told(truth: bool) -> str:
    return "true" if truth else "false"
