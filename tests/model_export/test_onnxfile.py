from __future__ import annotations

from pathlib import Path

import numpy as np
import onnxruntime
import torch
from torch import nn

from model_export.onnxfile import write_network


def test_a_written_network_answers_like_the_one_in_memory(tmp_path: Path) -> None:
    torch.manual_seed(0)
    network = nn.Sequential(nn.Linear(3, 4), nn.Dropout(0.5), nn.ReLU())
    count = torch.export.Dim("count", min=1, max=8)
    path = tmp_path / "small.onnx"
    write_network(network, torch.zeros(2, 3), path, ("cloud", "answer"), ({0: count},))
    session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
    for size in (1, 5):
        cloud = torch.randn(size, 3)
        (found,) = session.run(["answer"], {"cloud": cloud.numpy()})
        with torch.no_grad():
            np.testing.assert_allclose(found, network(cloud).numpy(), atol=1e-6)
    assert not (tmp_path / "small.onnx.data").exists()


def test_a_file_tells_nothing_of_the_machine_that_wrote_it(tmp_path: Path) -> None:
    path = tmp_path / "small.onnx"
    write_network(nn.Sequential(nn.Linear(3, 4), nn.ReLU()), torch.zeros(2, 3), path, ("a", "b"))
    content = path.read_bytes()
    assert b".py" not in content
    assert str(Path(torch.__file__).parent).encode() not in content
