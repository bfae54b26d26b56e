"""The models that are served: the shipped ones, and an operator's own beside them."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

from service.encode.card import unreadable
from service.encode.discriminator import DISCRIMINATOR_SUFFIX
from service.encode.installed import Installed as Installed
from service.encode.meshencoder import MESH_SUFFIX
from service.encode.model import Model, file_digest, load_model
from service.encode.versions import full_name
from service.errors import ModelFault, ShapeError
from service.mesh.frame import AUTO

SUFFIXES = (".json", ".onnx", DISCRIMINATOR_SUFFIX, MESH_SUFFIX, ".yaml")
"""The files of a model of one's own: its card, its networks and its template."""
NO_DEFAULTS: Mapping[str, str] = MappingProxyType({})

logger = logging.getLogger(__name__)

Read = tuple[str, Model]
"""A digest of a model's files, and the model."""


class Catalog:
    """Loads and verifies models, again whenever it is asked to.

    The shipped models are loaded once, and one of them bad is an error: the installation is broken.
    One of the operator's own may be bad at any time, while it is being copied say: then it is named
    as a fault, and what was served from its place before is served on.
    """

    def __init__(
        self,
        shipped: Callable[[], Mapping[str, Model]],
        own: Path | None,
        threads: int,
        body: Path | None = None,
        defaults: Mapping[str, str] = NO_DEFAULTS,
    ) -> None:
        """
        Args:
            shipped: loads the models that come with the service.
            own: the operator's folder, with models in it and in its subfolders.
            threads: that one encoding may use.
            body: the operator's body file, for models of bodies.
            defaults: versions to serve by default, by category.
        """
        self._load_shipped = shipped
        self._own = own
        self._threads = threads
        self._body = body
        self._defaults = defaults
        self._shipped: Mapping[str, Model] | None = None
        self._read: dict[Path, Read] = {}
        self._served: dict[str, Model] = {}

    def load(self) -> Installed:
        """Look again: new and changed models are loaded and verified, removed ones are gone.

        Not to be called from two threads at once.

        Raises:
            ModelFault: for a shipped model that can't be trusted.
        """
        if self._shipped is None:
            self._shipped = self._verified_shipped()
        faults: list[ModelFault] = []
        self._read = self._look(faults)
        self._served = self._distinct(faults)
        shipped, own = self._shipped.values(), self._served.values()
        return Installed.of(shipped, own, self._defaults, faults)

    def _verified_shipped(self) -> Mapping[str, Model]:
        try:
            shipped = self._load_shipped()
            for model in shipped.values():
                model.verify()
            return shipped
        except ModelFault as fault:
            if fault.code == "body_model" and self._body is not None:
                raise
            raise ModelFault(
                fault.code,
                f"A model that comes with the service can't be trusted: {fault.detail}.",
                "Install the service again, or take a fresh image; or name the other categories in "
                "CATEGORIES to do without this one.",
            ) from fault

    def _look(self, faults: list[ModelFault]) -> dict[Path, Read]:
        """What is in the operator's folders now, by the paths of the cards."""
        if self._own is None:
            return {}
        try:
            folders = [self._own, *sorted(_visible(self._own, Path.is_dir))]
        except OSError as error:
            faults.append(_unreadable(self._own, error))
            return self._read
        read: dict[Path, Read] = {}
        for folder in folders:
            try:
                cards = sorted(card for card in _visible(folder) if card.suffix == ".json")
            except OSError as error:
                faults.append(_unreadable(folder, error))
                read |= {card: was for card, was in self._read.items() if card.parent == folder}
                continue
            for card in cards:
                try:
                    read[card] = self._current(card, read)
                except ModelFault as fault:
                    faults.append(self._placed(fault, card))
                    if card in self._read:
                        read[card] = self._read[card]
        return read

    def _current(self, card: Path, beside: Mapping[Path, Read]) -> Read:
        """The model of a card as its files are now; one that was read of the same files before, or
        from another folder just now, is not loaded again."""
        try:
            digest = self._digest(card)
            for known in (*self._read.values(), *beside.values()):
                if known[0] == digest:
                    return known
            model = load_model(card, self._threads, self._body)
            if model.name != card.stem or model.name == AUTO:
                raise ModelFault(
                    "model_name",
                    f"{card.name} is the card of a model named {model.name!r}",
                    "Name the files of a model after it, and no model 'auto'.",
                )
            model.verify()
            if self._digest(card) != digest:
                raise ModelFault(
                    "model_changing",
                    f"the files of {card.name} changed while they were read",
                    "Reload when they are all in place; better, copy them to another folder of the "
                    "same disk first, and rename that.",
                )
            return digest, model
        except ShapeError:
            raise
        except OSError as error:
            raise ModelFault(
                "model_unreadable",
                f"a file of {card.name} can't be read: {error.strerror}",
                "Let the service's user read all files of the model, and reload.",
            ) from error
        except Exception as error:
            # Whatever a bad file sets off, the other models are served.
            logger.exception("%s can't be loaded", card)
            raise unreadable(card, type(error).__name__) from error

    def _digest(self, card: Path) -> str:
        files = {suffix: card.with_suffix(suffix) for suffix in SUFFIXES}
        if self._body is not None:
            files["body"] = self._body
        there = [f"{part} {file_digest(file)}" for part, file in files.items() if file.is_file()]
        return " ".join([card.stem, *there])

    def _distinct(self, faults: list[ModelFault]) -> dict[str, Model]:
        """The models that were read, one of each version: of two that claim the same one that was
        served before, else the one in the folder that comes first."""
        found: dict[str, list[tuple[Path, Model]]] = {}
        for card, (_, model) in self._read.items():
            found.setdefault(full_name(model), []).append((card, model))
        served = {}
        for name, places in found.items():
            before = self._served.get(name)
            first = next((place for place in places if place[1] is before), places[0])
            served[name] = first[1]
            for card, model in places:
                if model is not first[1]:
                    faults.append(
                        self._placed(
                            ModelFault(
                                "model_duplicate",
                                f"another {name} is served already, whose files differ: the one in "
                                f"{first[0].parent.name!r}",
                                "Remove one of them, or export it with a version of its own.",
                            ),
                            card,
                        )
                    )
        return served

    def _placed(self, fault: ModelFault, card: Path) -> ModelFault:
        """A fault that says in which subfolder it is."""
        if card.parent == self._own:
            return fault
        return ModelFault(fault.code, f"in {card.parent.name!r}: {fault.detail}", fault.suggestion)


def _visible(folder: Path, kind: Callable[[Path], bool] = Path.is_file) -> Iterator[Path]:
    """Files or folders in a folder, without hidden ones.

    Mounted Kubernetes volumes hold their files a second time in hidden folders.

    Raises:
        OSError: when it can't be read.
    """
    return (path for path in folder.iterdir() if not path.name.startswith(".") and kind(path))


def _unreadable(folder: Path, error: OSError) -> ModelFault:
    if isinstance(error, FileNotFoundError | NotADirectoryError):
        return ModelFault(
            "models_dir_missing",
            f"MODELS_DIR={str(folder)!r} is no folder",
            "Make it, with the models that model_export.export writes, and reload.",
        )
    return ModelFault(
        "models_dir_unreadable",
        f"{str(folder)!r} can't be read: {error.strerror}",
        "Let the service's user read and enter the models folder, and reload.",
    )
