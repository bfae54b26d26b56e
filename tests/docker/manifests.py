"""The manifests of docker/, read."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml

from service.settings import Settings

ROOT = Path(__file__).parents[2]
DOCKER = ROOT / "docker"
KUBERNETES = DOCKER / "kubernetes"

Manifest = dict[str, Any]


def read(path: Path) -> Manifest:
    """The one document of a YAML file."""
    manifest: Manifest = yaml.safe_load(path.read_text("utf-8"))
    return manifest


def kubernetes(name: str) -> Manifest:
    """The manifest docker/kubernetes/<name>.yaml."""
    return read(KUBERNETES / f"{name}.yaml")


def pod(manifest: Manifest) -> Manifest:
    """The pod that a Deployment or an InferenceService describes."""
    spec = manifest["spec"]
    found: Manifest = spec["predictor"] if "predictor" in spec else spec["template"]["spec"]
    return found


def quantity(text: str) -> float:
    """Kubernetes' ``256Mi``, ``2`` or ``500m`` as a number."""
    for suffix, factor in (("Ki", 2**10), ("Mi", 2**20), ("Gi", 2**30), ("m", 1e-3)):
        if text.endswith(suffix):
            return float(text.removesuffix(suffix)) * factor
    return float(text)


def image_environment() -> dict[str, str]:
    """What the Dockerfile's ENV instructions set in the final stage."""
    text = (DOCKER / "Dockerfile").read_text("utf-8").replace("\\\n", " ")
    last = text.rsplit("\nFROM ", 1)[1]
    pairs = [pair for line in re.findall(r"^ENV (.+)$", last, re.M) for pair in line.split()]
    return dict(pair.split("=", 1) for pair in pairs)


def settings(environment: dict[str, str]) -> Settings:
    """Settings as the service would read them; KeyError for a name that is none of its own."""
    unknown = {name for name in environment if name.lower() not in Settings.model_fields}
    if unknown:
        raise KeyError(unknown)
    return Settings.model_validate({name.lower(): value for name, value in environment.items()})
