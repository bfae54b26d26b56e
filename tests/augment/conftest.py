"""A chair that is known, and the models, for tests of variants."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import pytest

from service.augment.variants import Source, source
from service.encode.model import SHIPPED, Model, load_models
from service.requests import EditOptions, InferOptions, Upload


@pytest.fixture(scope="session")
def models() -> Mapping[str, Model]:
    """The shipped chair's."""
    return load_models(SHIPPED, names=["chair"])


@pytest.fixture(scope="session")
def chair_source(chair_glb: bytes, models: Mapping[str, Model]) -> Iterator[Source]:
    """The box chair, to make variants of."""
    options = InferOptions(category="chair")
    with source(Upload(chair_glb, "chair.glb"), models, options, EditOptions()) as made:
        yield made
