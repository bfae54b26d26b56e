"""What a client sends: a file, and what it says of the file and of the edit."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property

from service.errors import InvalidRequest
from service.mesh.frame import AUTO

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
"""Length of each unit in metres."""
METRIC = ("glb", "gltf")
"""Formats whose unit is the metre, by their specification."""
MODES = ("blend", "paper")


@dataclass(frozen=True)
class Upload:
    """A file as it came."""

    data: bytes
    name: str | None = None
    content_type: str | None = None

    @cached_property
    def mesh_id(self) -> str:
        """Content address: ``sha256-<hex>``."""
        return f"sha256-{hashlib.sha256(self.data).hexdigest()}"


@dataclass(frozen=True)
class InferOptions:
    """What a client may say of its upload; see the HTTP contract."""

    category: str = AUTO
    up: str = AUTO
    front: str = AUTO
    units: str = "m"
    refine: bool = True


@dataclass(frozen=True)
class EditOptions:
    """How an edit is carried out; `keep` and `format` default to the category's and the file's.

    `strict` refuses an edit that can't be had to the letter; otherwise the nearest is made.
    """

    mode: str = "blend"
    keep: str | None = None
    format: str | None = None
    strict: bool = False


SIZES = ("target", "source")
"""Whose size a transfer comes to: the target's, in real units, or the source's own."""
POSITIONS = ("source", "target")
"""Where the result of a transfer stands: where the source does, or where the target does."""


@dataclass(frozen=True)
class TransferOptions(EditOptions):
    """How an edit is carried out whose values come from another shape.

    Attributes:
        parameters: names of those that are taken; None for all.
        size: one of `SIZES`.
        position: one of `POSITIONS`.
    """

    parameters: tuple[str, ...] | None = None
    size: str = "target"
    position: str = "source"


RESTS = ("upload", "t_pose")
"""Poses that a body's mesh may be bound in."""


@dataclass(frozen=True)
class SliderOptions:
    """What a mesh with sliders in it offers, and how.

    Attributes:
        parameters: their names; None for all.
        keep: the point that stays in place; None for the category's first.
        paired: two targets a parameter, for viewers that know no negative weights.
        quantize: store displacements as 16-bit fractions.
        joint_names: one of `jointnames.JOINT_NAMES`, for bodies.
        rest: one of `RESTS`, for bodies.
    """

    parameters: tuple[str, ...] | None = None
    keep: str | None = None
    paired: bool = False
    quantize: bool = False
    joint_names: str = "smpl"
    rest: str = "upload"


def require_units(units: str) -> None:
    """Raise `InvalidRequest` unless ``units`` is one of `UNITS`."""
    if units not in UNITS:
        raise InvalidRequest(
            "unknown_units",
            f"units={units[:40]!r} is no unit of length here",
            f"Use one of {', '.join(UNITS)}.",
        )


def file_unit(format: str, units: str) -> float:
    """Metres per unit of a file of a format, when the client's unit is ``units``."""
    return 1.0 if format in METRIC else UNITS[units]
