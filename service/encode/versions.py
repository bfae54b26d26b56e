"""Several versions of a category's model side by side: their names, their order, the choice."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Protocol, TypeVar

from packaging.version import InvalidVersion, Version

from service.errors import InvalidRequest, NotFound
from service.mesh.frame import AUTO

AT = "@"
"""Between a category and a version of its model: ``chair@1.0.0``."""


class Versioned(Protocol):
    """What is asked of a model."""

    @property
    def name(self) -> str:
        """Its category."""

    @property
    def version(self) -> str:
        """Which of the category's models it is."""

    @property
    def recognised(self) -> bool:
        """Whether `auto` may choose it."""


M = TypeVar("M", bound=Versioned)


def full_name(model: Versioned) -> str:
    """The name that means this model whatever the default is."""
    return f"{model.name}{AT}{model.version}"


def newest_first(models: Iterable[M]) -> tuple[M, ...]:
    """Models of one category, the highest version first; what is no number comes last."""

    def rank(model: M) -> tuple[bool, Version, str]:
        try:
            return True, Version(model.version), model.version
        except InvalidVersion:
            return False, Version("0"), model.version

    return tuple(sorted(models, key=rank, reverse=True))


def choose(models: Mapping[str, M], category: str) -> list[M]:
    """The models that an upload is looked at with.

    Args:
        models: by the names that clients may use: of categories, and full ones.
        category: what the client says: one of them, or ``auto`` for the default models of all
            categories but those that are not to be recognised, if there are others.

    Raises:
        NotFound: when there is no model at all.
        InvalidRequest: for any other name.
    """
    if not models:
        raise NotFound(
            "no_models", "no model is installed", "Put models into the models folder and restart."
        )
    if category == AUTO:
        defaults = [model for name, model in models.items() if AT not in name]
        return [model for model in defaults if model.recognised] or defaults
    if category not in models:
        detail, names = explain_unknown(models, category)
        raise InvalidRequest("unknown_category", detail, f"Use one of {names}, or {AUTO}.")
    return [models[category]]


def explain_unknown(models: Mapping[str, Versioned], name: str) -> tuple[str, str]:
    """What is wrong with a name that is none of ``models``, and those that come nearest."""
    category, at, version = name.partition(AT)
    if at and category in models:
        others = [own for own in models if own.startswith(f"{category}{AT}")]
        return f"There is no version {version[:80]!r} of {category}.", ", ".join(others)
    names = [own for own in models if AT not in own]
    return f"There is no category {name[:80]!r}.", ", ".join(names)
