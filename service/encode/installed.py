"""Which models are served under which names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from service.encode.basemodel import Model
from service.encode.versions import full_name, newest_first
from service.errors import ModelFault


@dataclass(frozen=True)
class Installed:
    """What a look at the folders found.

    Attributes:
        models: the default model of each category.
        faults: of the operator's own models that can't be served, or are not the default that they
            should be.
        versions: all models of each category, the highest version first.
    """

    models: Mapping[str, Model]
    faults: tuple[ModelFault, ...] = ()
    versions: Mapping[str, tuple[Model, ...]] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        shipped: Iterable[Model],
        own: Iterable[Model],
        defaults: Mapping[str, str],
        faults: Iterable[ModelFault] = (),
    ) -> Installed:
        """Choose the defaults.

        One of the operator's own stands in for a shipped one of the same version, and goes before
        shipped ones of others; among several the highest version does.

        Args:
            shipped, own: all models, one a version.
            defaults: versions to serve by default instead, by category.
            faults: found so far.
        """
        ours = {full_name(model): model for model in own}
        served = {full_name(model): model for model in shipped} | ours
        versions = {
            name: newest_first(model for model in served.values() if model.name == name)
            for name in dict.fromkeys(model.name for model in served.values())
        }
        models = {
            name: next((model for model in several if full_name(model) in ours), several[0])
            for name, several in versions.items()
        }
        missing = []
        for name, version in defaults.items():
            several = versions.get(name, ())
            wanted = [model for model in several if model.version == version]
            if wanted:
                models[name] = wanted[0]
            else:
                missing.append(_missing(name, version, models.get(name), several))
        return cls(models, (*faults, *missing), versions)

    @cached_property
    def named(self) -> Mapping[str, Model]:
        """The models by every name that a client may use: its category's, for the default, and its
        own with the version."""
        models = [model for several in self.versions.values() for model in several]
        return {**self.models, **{full_name(model): model for model in models}}

    @cached_property
    def names(self) -> list[str]:
        """The names that clients choose among, sorted: full ones only where there are several
        versions."""
        several = [models for models in self.versions.values() if len(models) > 1]
        return sorted([*self.models, *(full_name(model) for own in several for model in own)])

    def describe(self, name: str) -> dict[str, Any]:
        """What is told of a category, or of a version of it, by one of `named`'s names."""
        model = self.named[name]
        default = self.models[model.name]
        versions = [
            {
                "name": full_name(own),
                "version": own.version,
                "digest": own.digest,
                "default": own is default,
            }
            for own in self.versions[model.name]
        ]
        return {**model.describe(), "versions": versions}


def _missing(
    name: str, version: str, instead: Model | None, several: tuple[Model, ...]
) -> ModelFault:
    if instead is None:
        return ModelFault(
            "default_missing",
            f"DEFAULT_MODELS names {name}={version}, but no model of {name} is served",
            f"Put the model into MODELS_DIR and reload, or take {name} out of DEFAULT_MODELS and "
            "restart.",
        )
    return ModelFault(
        "default_missing",
        f"DEFAULT_MODELS names {name}={version}, which is not served; {full_name(instead)} is the "
        "default instead",
        "Put that version into MODELS_DIR and reload, or name one of "
        f"{', '.join(model.version for model in several)} and restart.",
    )
