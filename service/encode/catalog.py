"""The models that are served: the shipped ones, and an operator's own beside them."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from service.encode.discriminator import DISCRIMINATOR_SUFFIX
from service.encode.meshencoder import MESH_SUFFIX
from service.encode.model import Model, file_digest, load_model
from service.errors import ModelFault, ShapeError
from service.mesh.frame import AUTO

SUFFIXES = (".json", ".onnx", DISCRIMINATOR_SUFFIX, MESH_SUFFIX, ".yaml")
"""The files of a model of one's own: its card, its networks and its template."""

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Installed:
    """What a look at the folders found.

    Attributes:
        models: that can be served, by category.
        faults: of the operator's own models that can't.
    """

    models: Mapping[str, Model]
    faults: tuple[ModelFault, ...] = ()


class Catalog:
    """Loads and verifies models, again whenever it is asked to.

    The shipped models are loaded once, and one of them bad is an error: the installation is broken.
    One of the operator's own may be bad at any time, while it is being copied say: then it is named
    as a fault, and what was served under its name before is served on.
    """

    def __init__(
        self,
        shipped: Callable[[], Mapping[str, Model]],
        own: Path | None,
        threads: int,
        body: Path | None = None,
    ) -> None:
        """
        Args:
            shipped: loads the models that come with the service.
            own: folder of the operator's; a model there replaces a shipped one of its name.
            threads: that one encoding may use.
            body: the operator's body file, for models of bodies.
        """
        self._load_shipped = shipped
        self._own = own
        self._threads = threads
        self._body = body
        self._shipped: Mapping[str, Model] | None = None
        self._loaded: dict[str, tuple[str, Model]] = {}

    def load(self) -> Installed:
        """Look again: new and changed models are loaded and verified, removed ones are gone.

        Not to be called from two threads at once.

        Raises:
            ModelFault: for a shipped model that can't be trusted.
        """
        if self._shipped is None:
            shipped = self._load_shipped()
            for model in shipped.values():
                model.verify()
            self._shipped = shipped
        loaded: dict[str, tuple[str, Model]] = {}
        faults: list[ModelFault] = []
        for card in self._cards(faults):
            before = self._loaded.get(card.stem)
            try:
                loaded[card.stem] = self._current(card, before)
            except ModelFault as fault:
                faults.append(fault)
                if before is not None:
                    loaded[card.stem] = before
        self._loaded = loaded
        own = {name: model for name, (_, model) in loaded.items()}
        return Installed({**self._shipped, **own}, tuple(faults))

    def _cards(self, faults: list[ModelFault]) -> list[Path]:
        if self._own is None:
            return []
        if not self._own.is_dir():
            faults.append(
                ModelFault(
                    "models_dir_missing",
                    f"MODELS_DIR={str(self._own)!r} is no folder",
                    "Make it, with the models that model_export.export writes, and reload.",
                )
            )
        return sorted(self._own.glob("*.json"))

    def _current(self, card: Path, before: tuple[str, Model] | None) -> tuple[str, Model]:
        """The model of a card with the digest of its files; the one before if they are the same."""
        try:
            files = [card.with_suffix(suffix) for suffix in SUFFIXES]
            files += [self._body] if self._body else []
            digest = " ".join(file_digest(file) for file in files if file.is_file())
            if before is not None and before[0] == digest:
                return before
            model = load_model(card, self._threads, self._body)
            if model.name != card.stem or model.name == AUTO:
                raise ModelFault(
                    "model_name",
                    f"{card.name} is the card of a model named {model.name!r}",
                    "Name the files of a model after it, and no model 'auto'.",
                )
            model.verify()
            return digest, model
        except ShapeError:
            raise
        except Exception as error:
            # Whatever a bad file sets off, the other models are served.
            logger.exception("%s can't be loaded", card.name)
            raise ModelFault(
                "model_unreadable",
                f"{card.name} can't be loaded: {type(error).__name__}",
                "Export the model again, or remove it from the models folder.",
            ) from error
