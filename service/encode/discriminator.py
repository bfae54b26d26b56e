"""How much a cloud looks like a category's shape, upright and facing the front."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from service.encode.session import cloud_size, open_session
from service.mesh.frame import Orientation
from service.mesh.surface import Normalization

DISCRIMINATOR_SUFFIX = ".discriminator.onnx"
"""Its file is called the category's name and this."""


class Discriminator:
    """A loaded network: views of a cloud in, the log odds of each in one call out."""

    def __init__(self, path: Path, threads: int = 1, digest: str | None = None) -> None:
        """
        Args:
            path: the ONNX file.
            threads: that one call may use.
            digest: of the file, see `open_session`.

        Raises:
            ModelFault: when the file is no such network.
        """
        self._session = open_session(path, threads, digest)
        self.points = cloud_size(self._session, path, single=False)

    def odds(
        self, cloud: NDArray[np.float64], orientations: Sequence[Orientation]
    ) -> NDArray[np.float64]:
        """Log odds ``[k]`` that a cloud is a shape of the category with each orientation.

        Args:
            cloud: ``[n, 3]`` points on the upload in its own frame, any scale and place.
            orientations: ``k`` of them.
        """
        # Samples come in the order of the faces: spread the choice over all of them.
        chosen = np.linspace(0, len(cloud) - 1, self.points).round().astype(np.int64)
        points = Normalization.of(cloud[chosen]).apply(cloud[chosen])
        views = np.stack([way.to_canonical(points) for way in orientations]).astype(np.float32)
        (odds,) = self._session.run(None, {"views": views})
        return np.asarray(odds, dtype=np.float64)
