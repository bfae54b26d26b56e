"""What a batch is to do: options that travel to workers on this machine and on others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from service.augment.options import AugmentOptions
from service.encode.basemodel import Model
from service.encode.catalog import Catalog
from service.encode.model import SHIPPED, load_models
from service.encode.versions import AT, choose
from service.errors import NotFound
from service.requests import EditOptions, InferOptions
from service.shipped import usual_categories


@dataclass(frozen=True)
class Models:
    """Where models are.

    Attributes:
        shipped: those that come along and are wanted; None for the usual ones.
        own: a folder of one's own.
        body: a body's file of one's own.
        defaults: versions by category.
    """

    shipped: tuple[str, ...] | None = None
    own: Path | None = None
    body: Path | None = None
    defaults: Mapping[str, str] = field(default_factory=dict)

    def load(self, category: str) -> Mapping[str, Model]:
        """Those that a category needs, one thread each.

        Raises:
            ModelFault: when one can't be trusted.
            NotFound: for a category that there is none of.
        """
        names = usual_categories() if self.shipped is None else self.shipped
        name = category.partition(AT)[0]
        wanted = (name,) if name in names else names
        defaults = {one: v for one, v in self.defaults.items() if one in wanted or self.own}
        shipped = partial(load_models, SHIPPED, 1, self.body, wanted)
        installed = Catalog(shipped, self.own, 1, self.body, defaults).load()
        if installed.faults:
            raise installed.faults[0]
        if not installed.models:
            raise NotFound("no_models", "No model is installed.", "Name categories, or a folder.")
        choose(installed.named, category)
        return installed.named


@dataclass(frozen=True)
class Plan:
    """A batch.

    Attributes:
        out: the folder that it writes.
        augment, infer, edit: as for one upload.
        models: that it goes by.
        deadline_s: seconds that one source may take.
    """

    out: Path
    augment: AugmentOptions
    infer: InferOptions
    edit: EditOptions
    models: Models
    deadline_s: float

    def recorded(self, models: Mapping[str, Model]) -> dict[str, Any]:
        """What results depend on: two runs into one folder must have it in common."""
        served = {model.name: model for model in choose(models, self.infer.category)}
        return {
            "version": version("shape-parameters"),
            **asdict(self.augment),
            **asdict(self.infer),
            **asdict(self.edit),
            "models": {
                name: served[name].identity | {"fingerprint": served[name].fingerprint}
                for name in sorted(served)
            },
        }


@dataclass(frozen=True)
class Task:
    """A file to make variants of.

    Attributes:
        path: of the file.
        source: its name, from the batch's folder on.
        digest: sha256 of its bytes, in hex.
        copies: names of other files with the same bytes.
    """

    path: Path
    source: str
    digest: str
    copies: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """What its variants' folder and its part of the manifest are called."""
        stem = "".join(c if c.isalnum() or c in "._-" else "_" for c in Path(self.source).stem)
        return f"{stem[:60].lstrip('.') or 'mesh'}-{self.digest[:DIGITS]}"


DIGITS = 16
"""Of a digest in the name of a folder: no two files of a dataset share them."""


@dataclass(frozen=True)
class Outcome:
    """What became of a file.

    Attributes:
        source: its name.
        ok, rejected: how many variants there are, and how many could not be had.
        code, detail: what is wrong with the file, if anything.
    """

    source: str
    ok: int = 0
    rejected: int = 0
    code: str | None = None
    detail: str | None = None
