"""Networks as ONNX files."""

from __future__ import annotations

import logging
import warnings
from pathlib import Path
from typing import Any

import onnx
import torch
from torch import Tensor, nn


def write_network(
    network: nn.Module, example: Tensor, path: Path, names: tuple[str, str], shapes: Any = None
) -> None:
    """Write a network of one input and one output, in evaluation mode.

    Args:
        network: to write.
        example: of its input.
        path: of the file.
        names: of input and output.
        shapes: what of the input may vary, as `torch.onnx.export` wants it; by default nothing.
    """
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.onnx.export(
            network.eval(),
            (example,),
            str(path),
            input_names=[names[0]],
            output_names=[names[1]],
            dynamic_shapes=shapes,
            dynamo=True,
            external_data=False,
            verbose=False,
        )
    _write_plain(path)


def _write_plain(path: Path) -> None:
    """Leave out what the exporter notes of its own: traces with the paths of this machine."""
    model = onnx.load(path)
    graph = model.graph
    noted = [model, graph, *graph.node, *graph.input, *graph.output, *graph.value_info]
    for entry in [*noted, *graph.initializer, *model.functions]:
        entry.ClearField("metadata_props")
    onnx.save(model, path)
