"""Write the model for clients' own tests: ``python -m model_export.debug_model``.

Nothing is trained: its encoder is a formula, the extents of a cloud, and its discriminator takes
everything for a box.  The same files come out every time.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import onnx
from onnx import TensorProto, helper

from service.encode.debugmodel import DebugModel
from service.encode.discriminator import DISCRIMINATOR_SUFFIX
from service.encode.model import SHIPPED, file_digest, golden_cloud, load_model
from service.encode.session import EncoderSession
from service.shipped import DEBUG
from service.template.loader import load_template, template_path

VIEWED = 8
"""Points of the clouds that the discriminator does not look at."""
LIMIT_DISTANCE, LIMIT_ODDS = 1e3, -40.0
"""So far off that every mesh is a good box."""


def write_encoder(path: Path, points: int) -> None:
    """A network of ``points [1, points, 3]`` to the extents along x, y and z, then the middles."""
    nodes = [
        helper.make_node("ReduceMax", ["points", "axes"], ["last"], keepdims=0),
        helper.make_node("ReduceMin", ["points", "axes"], ["first"], keepdims=0),
        helper.make_node("Sub", ["last", "first"], ["extents"]),
        helper.make_node("Add", ["last", "first"], ["twice"]),
        helper.make_node("Mul", ["twice", "half"], ["middles"]),
        helper.make_node("Concat", ["extents", "middles"], ["outputs"], axis=1),
    ]
    constants = [
        helper.make_tensor("axes", TensorProto.INT64, [1], [1]),
        helper.make_tensor("half", TensorProto.FLOAT, [], [0.5]),
    ]
    _write(path, nodes, constants, ("points", [1, points, 3]), ("outputs", [1, 6]))


def write_discriminator(path: Path) -> None:
    """A network of ``views [count, VIEWED, 3]`` to log odds of 0 each."""
    nodes = [
        helper.make_node("ReduceMax", ["views", "axes"], ["last"], keepdims=0),
        helper.make_node("Mul", ["last", "nothing"], ["odds"]),
    ]
    constants = [
        helper.make_tensor("axes", TensorProto.INT64, [2], [1, 2]),
        helper.make_tensor("nothing", TensorProto.FLOAT, [], [0.0]),
    ]
    _write(path, nodes, constants, ("views", ["count", VIEWED, 3]), ("odds", ["count"]))


def _write(
    path: Path,
    nodes: list[Any],
    constants: list[Any],
    given: tuple[str, list[int | str]],
    answered: tuple[str, list[int | str]],
) -> None:
    inputs = [helper.make_tensor_value_info(given[0], TensorProto.FLOAT, given[1])]
    outputs = [helper.make_tensor_value_info(answered[0], TensorProto.FLOAT, answered[1])]
    graph = helper.make_graph(nodes, "debug", inputs, outputs, constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=10)
    onnx.checker.check_model(model)
    onnx.save(model, path)


def write_model(folder: Path, version: str = "1.0.0") -> Path:
    """Write networks and card to a folder; the path of the card."""
    template = load_template(DEBUG)
    path = folder / f"{DEBUG}.onnx"
    write_encoder(path, template.points)
    discriminator = path.with_suffix(DISCRIMINATOR_SUFFIX)
    write_discriminator(discriminator)
    golden = EncoderSession(path).run(golden_cloud(template, template.points))
    card = {
        "name": template.name,
        "kind": DebugModel.kind,
        "label": template.label,
        "version": version,
        "digest": file_digest(path),
        "template_digest": file_digest(template_path(DEBUG)),
        "licence": "Apache-2.0",
        "input": {"points": template.points, "frame": "+Y up, +Z front"},
        "golden": [round(float(value), 6) for value in golden],
        "discriminator": {"digest": file_digest(discriminator)},
        "calibration": {"limit_distance": LIMIT_DISTANCE, "limit_odds": LIMIT_ODDS},
    }
    path.with_suffix(".json").write_text(json.dumps(card, indent=2) + "\n", "utf-8")
    load_model(path.with_suffix(".json")).verify()
    return path.with_suffix(".json")


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.debug_model", description=__doc__)
    parser.add_argument("--out", type=Path, default=SHIPPED, help="models folder")
    parser.add_argument("--version", default="1.0.0", help="of the model")
    given = parser.parse_args(arguments)
    print(f"wrote {write_model(given.out, given.version)}")


if __name__ == "__main__":
    main()
