"""The manifest: a row a variant, in Parquet, a part a source."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from service.augment.labels import PartLabels
from service.augment.variant import Variant
from service.encode.basemodel import Model
from service.errors import InvalidRequest
from service.inference import Inference
from service.requests import UNITS

try:
    import pyarrow as pa
    from pyarrow import parquet
except ModuleNotFoundError:
    pa = parquet = None

FIGURES = ("flipped_faces", "degenerate_faces", "new_crossings_per_10k", "opened_gaps")


def require_arrow() -> None:
    """Raise `InvalidRequest` (``pyarrow_missing``) where manifests can't be written."""
    if pa is None:
        raise InvalidRequest(
            "pyarrow_missing",
            "manifests are written with pyarrow, which is not installed",
            "Install it: pip install 'shape-parameters[augment]'",
        )


class Manifest:
    """How rows of one batch are written: its columns, the same in every part."""

    def __init__(self, models: Iterable[Model], units: str, parts: Mapping[str, Sequence[str]]):
        """
        Args:
            models: the categories that there may be.
            units: that lengths are told in.
            parts: names of the parts that labels count, by category.
        """
        values = {}
        for model in models:
            for entry in model.entries():
                kind = "derived" if entry["derived"] else "parameter"
                unit = entry["unit"] if entry["unit"] not in UNITS else units
                values[f"{kind}.{entry['name']}"] = pa.field(
                    f"{kind}.{entry['name']}", pa.float64(), metadata={"unit": unit}
                )
        names = json.dumps({name: list(own) for name, own in parts.items()}, sort_keys=True)
        self.schema = pa.schema(
            [
                *_text("source", "source_sha256"),
                pa.field("copies", pa.list_(pa.string())),
                pa.field("index", pa.int32()),
                *_text("status", "file", "sha256", "format", "category"),
                *_text("model_name", "model_version", "model_digest", "kind"),
                pa.field("seed", pa.int64()),
                pa.field("attempt", pa.int32()),
                *(pa.field(name, pa.float64()) for name in ("strength", "share")),
                *_text("drawn_from", "edits"),
                *(values[name] for name in sorted(values)),
                *(pa.field(f"validity.{name}", pa.float64()) for name in FIGURES),
                pa.field("labels", pa.list_(pa.int16()), metadata={"parts": names}),
                *_text("up", "front"),
                pa.field("scale", pa.float64()),
                *_text("unit"),
                pa.field("vertices", pa.int64()),
                pa.field("faces", pa.int64()),
                pa.field("warnings", pa.list_(pa.string())),
                *_text("problem_code", "problem_detail", "version"),
            ],
            metadata={"parts": names, "units": units},
        )

    def write(self, path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
        """Write a part: all of it or nothing, and the same bytes for the same rows."""
        table = pa.Table.from_pylist(list(rows), self.schema)
        temporary = path.with_name(f".{path.name}.{os.getpid()}")
        parquet.write_table(table, temporary, compression="zstd", store_schema=True)
        temporary.replace(path)


def _text(*names: str) -> list[Any]:
    return [pa.field(name, pa.string()) for name in names]


def source_facts(found: Inference, labels: PartLabels) -> dict[str, Any]:
    """What rows of one source have in common."""
    best, model = found.best, found.model
    return {
        "category": model.name,
        **{f"model_{name}": value for name, value in model.identity.items()},
        "kind": getattr(getattr(best.estimate, "template", None), "variant", "") or None,
        "labels": labels.labels,
        "up": best.orientation.up,
        "front": best.orientation.front,
        "scale": best.estimate.normalization.scale,
        "unit": found.unit,
        "vertices": len(found.mesh.vertices),
        "faces": len(found.mesh.faces),
    }


def variant_row(variant: Variant, folder: str) -> dict[str, Any]:
    """What is a variant's own; ``file`` is in a folder."""
    row, facts = variant.row(), variant.provenance
    shared = ("seed", "attempt", "strength", "share", "drawn_from", "version")
    return {
        **{name: row[name] for name in ("index", "status", "sha256", "format", "warnings")},
        **{name: facts[name] for name in shared},
        "file": f"{folder}/{row['file']}" if row["file"] else None,
        "edits": json.dumps(row["edits"]),
        **_values("parameter", row["parameters"]),
        **_values("derived", row["derived"]),
        **{f"validity.{name}": value for name, value in row["validity"].items()},
        "problem_code": variant.problem.code if variant.problem else None,
        "problem_detail": variant.problem.detail if variant.problem else None,
    }


def _values(kind: str, told: Mapping[str, Mapping[str, Any]]) -> dict[str, float]:
    return {f"{kind}.{name}": value["value"] for name, value in told.items()}
