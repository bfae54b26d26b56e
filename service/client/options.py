"""The options of the calls, as keyword arguments."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Literal, TypedDict

import httpx

from service.client.call import Sending
from service.client.multipart import Field, Progress
from service.client.retry import Retry
from service.client.values import Values, as_json

Direction = Literal["auto", "+x", "-x", "+y", "-y", "+z", "-z"]
Units = Literal["m", "cm", "mm", "in", "ft"]
Format = Literal["glb", "gltf", "obj", "ply", "stl", "off"]


class How(TypedDict, total=False):
    """Options of every call."""

    timeout: float | httpx.Timeout | None
    """Seconds for each of connecting, writing and reading; by default the client's."""
    progress: Progress | None
    """Called with the bytes of the upload that are done, and how many there are."""
    download_progress: Progress | None
    """The same of the answer; of unknown size where it is None."""
    retry: Retry | None
    """By default the client's."""


class Saving(How, total=False):
    """Options of calls that answer a file."""

    to: str | PathLike[str] | None
    """The file to write the answer to, a chunk at a time; by default it is held in memory."""


class Reading(How, total=False):
    """How to read a mesh."""

    category: str
    """A name that `categories` lists, `chair@1.0.0` for one version of its model, or `auto`."""
    up: Direction
    """The mesh's axis that points up; by default `auto`."""
    front: Direction
    """The mesh's axis that points to the front; by default `auto`."""
    units: Units
    """The file's unit of length, and the answer's; glTF is always metres, the default."""
    refine: bool
    """Whether to improve the inferred values by a fit to the mesh; by default yes."""


class EditingReport(Reading, total=False):
    """How to edit."""

    constraints: Values | str | None
    """What to keep to by the least change, beside the edits or without any."""
    mode: Literal["blend", "paper"]
    """How the mesh follows its template."""
    keep: str | None
    """The point that stays in place; a category's `keep` lists them."""
    format: Format | None
    """The answer's format; by default the upload's own."""
    strict: bool
    """Refuse what would make a size negative, instead of making the nearest that does not."""


class Editing(EditingReport, Saving, total=False):
    """How to edit, and where the edited file goes."""


class Varying(Reading, Saving, total=False):
    """How to make variants."""

    mode: Literal["blend", "paper"]
    keep: str | None
    format: Format | None


class VaryingEdits(Varying, total=False):
    """How to make variants by edits that are given."""

    strict: bool


class Augmenting(Varying, total=False):
    """Which variants are drawn."""

    count: int
    """How many, 1 to 1000; by default 10."""
    seed: int
    """The same seed, the same variants; by default 0."""
    strength: float
    """0 to 1: how far from the upload towards a draw from real shapes; by default 1."""


class Offering(Reading, Saving, total=False):
    """Which sliders to put into a mesh."""

    parameters: str | Sequence[str] | None
    """Names; by default all."""
    keep: str | None
    paired: bool
    """Two morph targets a parameter, for viewers that clamp weights to 0..1."""
    quantize: bool
    """Store displacements as 16-bit fractions where that is exact enough."""
    joint_names: Literal["smpl", "mixamo", "vrm"]
    rest: Literal["upload", "t_pose"]


class TransferringReport(Reading, total=False):
    """What to take from the target, and how it is read; the other options are the source's."""

    target_up: Direction
    target_front: Direction
    target_units: Units | None
    """By default as `units`."""
    parameters: str | Sequence[str] | None
    """What to take; by default all that both have."""
    size: Literal["target", "source"]
    """Whose size it comes to; by default the target's."""
    position: Literal["source", "target"]
    """Where it stands; by default where the source does."""
    mode: Literal["blend", "paper"]
    keep: str | None
    format: Format | None
    strict: bool


class Transferring(TransferringReport, Saving, total=False):
    """The same, and where the edited file goes."""


class Submitting(TypedDict, total=False):
    """Options of a call that starts a job."""

    idempotency_key: str | None
    """The same key gives the same job again; by default a new one for each call."""


class SubmittingEdits(VaryingEdits, Submitting, total=False):
    """A job of `edit_variants`."""


class SubmittingAugment(Augmenting, Submitting, total=False):
    """A job of `augment`."""


HOW = frozenset(Saving.__optional_keys__)


def split(options: Mapping[str, Any], known: Any) -> tuple[tuple[Field, ...], Sending]:
    """The form's fields, and how the call is made.

    Args:
        options: as given; None counts as not given.
        known: the TypedDict that they belong to.

    Raises:
        TypeError: when there is no such option.
    """
    if unknown := sorted(options.keys() - known.__optional_keys__):
        names = ", ".join(sorted(known.__optional_keys__))
        raise TypeError(f"there is no option {unknown[0]!r}; there are {names}")
    how = {name: options[name] for name in options if name in HOW}
    if how.get("to") is not None:
        how["to"] = Path(how["to"])
    fields = [
        (name, _text(name, value))
        for name, value in options.items()
        if name not in HOW and value is not None
    ]
    return tuple(fields), Sending(**how)


def _text(name: str, value: Any) -> str:
    """What a field of the form holds."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return str(value).lower()
    if name == "parameters":
        return json.dumps(list(value))
    if isinstance(value, Mapping):
        return as_json(value)
    return str(value)
