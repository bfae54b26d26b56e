"""Whether the installed models are loaded and can be trusted."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping

import anyio
from anyio import to_thread

from service.encode.catalog import Installed
from service.encode.model import Model
from service.errors import ModelFault, ShapeError

Load = Callable[[], Installed]

# Loading takes a second or so; a request that comes meanwhile waits rather than fails.
PATIENCE_S = 30.0

logger = logging.getLogger(__name__)


class Readiness:
    """Loads the models and holds them, or what is wrong with them.

    A request takes the models as they are when it comes and works with those to its end, whatever
    is reloaded meanwhile.

    Attributes:
        draining: whether the service is about to stop.
        reloads: how often the models were loaded anew, by result.
    """

    def __init__(self, load: Load) -> None:
        """`load` finds verified models; it may be called again, but never twice at once."""
        self._load = load
        self.draining = False
        self.reloads = {"success": 0, "failure": 0}
        self._started = False
        self._installed: Installed | None = None
        self._fault: ShapeError | None = None
        self._done = anyio.Event()
        self._reloading = anyio.Lock()

    def drain(self) -> None:
        """The service is about to stop: `/readyz` says so; requests are still served."""
        self.draining = True

    async def start(self) -> None:
        """Load every model and put its golden request to it, in a thread."""
        self._started = True
        try:
            self._installed = await self._look()
        except ShapeError as error:
            self._fault = error
            logger.error("not ready: %s", error)
        except Exception:
            logger.exception("not ready")
            self._fault = ModelFault(
                "model_fault", "The models could not be loaded.", "Read the service's log."
            )
        finally:
            self._done.set()

    async def reload(self) -> None:
        """Load the models anew; on any failure those from before are kept."""
        await self._done.wait()
        result = "failure"
        try:
            self._installed = await self._look()
            self._fault = None
            result = "success"
        except ShapeError as error:
            logger.error("not reloaded: %s", error)
        except Exception:
            logger.exception("not reloaded")
        finally:
            self.reloads[result] += 1

    async def _look(self) -> Installed:
        async with self._reloading:
            # Not by a worker: a reload neither waits for requests nor holds them up.
            installed = await to_thread.run_sync(self._load)
        for fault in installed.faults:
            logger.error("model fault: %s", fault)
        if not installed.models:
            raise _nothing_to_serve(installed)
        models = [model for several in installed.versions.values() for model in several]
        logger.info("ready: %s", ", ".join(f"{m.name} {m.version}" for m in models))
        return installed

    @property
    def installed(self) -> Installed:
        """The models and the faults of those that are not served.

        Raises:
            ModelFault: while they load (`starting`), or when a shipped one is bad.
        """
        if self._fault is not None:
            raise ModelFault("model_fault", self._fault.detail, self._fault.suggestion)
        if self._installed is None:
            raise ModelFault(
                "starting",
                "The models are still being loaded and verified.",
                "Ask again in a second.",
            )
        return self._installed

    @property
    def names(self) -> list[str]:
        """The names that clients choose among, sorted; none until they can be served."""
        return self._installed.names if self._installed else []

    async def models(self) -> Mapping[str, Model]:
        """The models by the names that clients may use; see `ready`."""
        return (await self.ready()).named

    async def ready(self) -> Installed:
        """As `installed`, but a request that comes during the start waits for it a while.

        Where the server runs no lifespan, the first such request is the start.
        """
        if not self._started:
            await self.start()
        with anyio.move_on_after(PATIENCE_S):
            await self._done.wait()
        return self.installed


def _nothing_to_serve(installed: Installed) -> ModelFault:
    if not installed.faults:
        return ModelFault(
            "model_fault",
            "No model is installed.",
            "Point MODELS_DIR at a folder that holds <category>.onnx and <category>.json, or name "
            "categories that come with the service in CATEGORIES.",
        )
    reasons = "; ".join(fault.detail for fault in installed.faults)
    suggestion = installed.faults[0].suggestion
    return ModelFault("model_fault", f"No model can be served: {reasons}.", suggestion)
