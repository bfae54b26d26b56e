"""What is asked of a job, in a form that outlives the process."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from typing import Any, Literal

from service.augment.options import AugmentOptions
from service.encode.basemodel import Model
from service.encode.versions import choose
from service.requests import EditOptions, InferOptions, Upload

Kind = Literal["edit", "augment"]
KINDS: tuple[Kind, ...] = ("edit", "augment")


@dataclass(frozen=True)
class Order:
    """Variants of one mesh.

    Attributes:
        kind: ``edit`` for those that `edits` says, ``augment`` for drawn ones.
        upload: the mesh.
        options, edit_options: as for `pipeline.edit`.
        edits: an object for each variant, as clients write it.
        draw: of drawn ones, how many and how.
    """

    kind: Kind
    upload: Upload
    options: InferOptions
    edit_options: EditOptions
    edits: Sequence[Mapping[str, Any]] = ()
    draw: AugmentOptions = field(default_factory=AugmentOptions)

    @property
    def total(self) -> int:
        """How many variants there are to be."""
        return len(self.edits) if self.kind == "edit" else self.draw.count

    def text(self) -> str:
        """All but the mesh, as JSON; the same text for the same order."""
        asked = {
            "kind": self.kind,
            "options": asdict(self.options),
            "edit_options": asdict(self.edit_options),
            "edits": list(self.edits),
            "draw": asdict(self.draw),
        }
        return json.dumps(asked, sort_keys=True)

    @classmethod
    def read(cls, text: str, upload: Upload) -> Order:
        """The order of a text."""
        asked = json.loads(text)
        return cls(
            asked["kind"],
            upload,
            InferOptions(**asked["options"]),
            EditOptions(**asked["edit_options"]),
            asked["edits"],
            AugmentOptions(**asked["draw"]),
        )

    def digest(self) -> str:
        """Tells orders apart by the mesh's bytes and what is asked, in hex."""
        return hashlib.sha256(f"{self.upload.mesh_id} {self.text()}".encode()).hexdigest()

    def makers(self, models: Mapping[str, Model]) -> str:
        """Tells apart what the variants are made by: the models in question, and this version.

        Raises:
            ShapeError: when there is no such category.
        """
        chosen = sorted(model.fingerprint for model in choose(models, self.options.category))
        return hashlib.sha256(
            json.dumps([version("shape-parameters"), chosen]).encode()
        ).hexdigest()[:32]
