"""Whether the installed models are loaded and can be trusted."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping

import anyio

from service.api.workers import Workers
from service.encode.model import Model
from service.errors import ModelFault, ShapeError

Load = Callable[[], Mapping[str, Model]]

# Loading takes a second or so; a request that comes meanwhile waits rather than fails.
PATIENCE_S = 30.0

logger = logging.getLogger(__name__)


class Readiness:
    """Loads the models once and holds them, or what is wrong with them."""

    def __init__(self, load: Load, workers: Workers) -> None:
        self._load = load
        self._workers = workers
        self._started = False
        self._models: Mapping[str, Model] | None = None
        self._fault: ShapeError | None = None
        self._done = anyio.Event()

    async def start(self) -> None:
        """Load every model and put its golden request to it, in a worker thread."""
        self._started = True
        try:
            self._models = await self._workers.run(self._load_verified)
            logger.info(
                "ready: %s", ", ".join(f"{m.name} {m.version}" for m in self._models.values())
            )
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

    def _load_verified(self) -> Mapping[str, Model]:
        models = self._load()
        if not models:
            raise ModelFault(
                "model_fault",
                "No model is installed.",
                "Point MODELS_DIR at a folder that holds <category>.onnx and <category>.json.",
            )
        for model in models.values():
            model.verify()
        return models

    def loaded(self) -> Mapping[str, Model]:
        """The models by category; ModelFault while they load (`starting`) or when one is bad."""
        if self._fault is not None:
            raise ModelFault("model_fault", self._fault.detail, self._fault.suggestion)
        if self._models is None:
            raise ModelFault(
                "starting",
                "The models are still being loaded and verified.",
                "Ask again in a second.",
            )
        return self._models

    async def models(self) -> Mapping[str, Model]:
        """As `loaded`, but a request that comes during the start waits for it a while.

        Where the server runs no lifespan, the first such request is the start.
        """
        if not self._started:
            await self.start()
        with anyio.move_on_after(PATIENCE_S):
            await self._done.wait()
        return self.loaded()
