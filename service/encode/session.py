"""onnxruntime sessions with every option set on purpose."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import onnxruntime
from numpy.typing import NDArray

from service.errors import ModelFault


def file_digest(path: Path) -> str:
    """``sha256-<hex>`` of a file."""
    with path.open("rb") as file:
        return f"sha256-{hashlib.file_digest(file, 'sha256').hexdigest()}"


def require_digest(path: Path, expected: str) -> None:
    """Raise `ModelFault` for a file that is missing, or not the one that its card speaks of."""
    if not path.is_file():
        raise ModelFault(
            "model_file_missing",
            f"{path.name} is missing",
            "Install all files of the model from the same export.",
        )
    digest = file_digest(path)
    if digest != expected:
        raise ModelFault(
            "model_digest",
            f"{path.name} is {digest}, its card says {expected}",
            "Install the model files and their card from the same export; if they were just being "
            "copied, reload when the copy is complete.",
        )


def open_session(
    path: Path, threads: int, digest: str | None = None
) -> onnxruntime.InferenceSession:
    """A session of an ONNX file.

    Args:
        path: the file.
        threads: that each run takes.
        digest: of the file as it should be; another one is not even parsed.

    Raises:
        ModelFault: when the file is missing, altered, or no network.
    """
    if digest is not None:
        require_digest(path, digest)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.execution_mode = onnxruntime.ExecutionMode.ORT_SEQUENTIAL
    # Spinning wins microseconds and costs whole cores that other requests need.
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    # The arena keeps its high-water mark for ever; with few shapes it gains nothing.
    options.enable_cpu_mem_arena = False
    options.log_severity_level = 3
    try:
        # By its path: a session keeps the bytes that it is given for as long as it lives.
        return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    except Exception as error:
        raise ModelFault(
            "model_unreadable",
            f"{path.name} can't be loaded: {type(error).__name__}",
            "Export the model again.",
        ) from error


def cloud_size(session: onnxruntime.InferenceSession, path: Path, single: bool) -> int:
    """Points of the clouds that a network takes: one, or any number of them at a time.

    Raises:
        ModelFault: when it takes anything else.
    """
    shape = session.get_inputs()[0].shape
    count_fits = len(shape) == 3 and (shape[0] == 1 if single else isinstance(shape[0], str))
    if not count_fits or shape[2] != 3 or not isinstance(shape[1], int):
        raise ModelFault(
            "model_shape",
            f"{path.name} takes {shape}, not [{'1' if single else 'count'}, points, 3]",
            "Export the model again.",
        )
    return int(shape[1])


class EncoderSession:
    """A loaded encoder: one cloud of a fixed size in; parameters, translation and the log odds of
    the template's variants, where it has any, out."""

    def __init__(self, path: Path, threads: int = 1, digest: str | None = None) -> None:
        """
        Args:
            path: the ONNX file.
            threads: that one encoding may use.
            digest: of the file, see `open_session`.

        Raises:
            ModelFault: when the file is no such network.
        """
        self._session = open_session(path, threads, digest)
        self.points = cloud_size(self._session, path, single=True)

    def run(self, points: NDArray[np.floating]) -> NDArray[np.float64]:
        """``[points, 3]`` normalised cloud to ``[d + 3 + K]`` outputs."""
        cloud = np.ascontiguousarray(points, dtype=np.float32)[None]
        (outputs,) = self._session.run(None, {"points": cloud})
        return np.asarray(outputs[0], dtype=np.float64)
