"""The same work on a cluster of this machine."""

from __future__ import annotations

from pathlib import Path

import pytest

from service.augment.driver import augment
from service.requests import InferOptions

pytest.importorskip("ray.data", reason="Ray is not installed: make test-ray")
import ray

pytestmark = pytest.mark.filterwarnings("ignore")


def files(out: Path) -> dict[str, bytes]:
    return {
        path.relative_to(out).as_posix(): path.read_bytes()
        for path in sorted(out.rglob("*"))
        if path.is_file()
    }


def test_a_cluster_makes_the_same_files_with_the_same_digests(
    tmp_path: Path, chair_glb: bytes
) -> None:
    meshes = tmp_path / "meshes"
    meshes.mkdir()
    for index in range(4):
        # What follows a GLB's declared length belongs to nobody: another file, the same mesh.
        (meshes / f"chair-{index}.glb").write_bytes(chair_glb + bytes(4 * index))
    (meshes / "broken.obj").write_text("v 0 0 0\n")
    options = InferOptions(category="chair")
    local = augment(meshes, tmp_path / "local", 2, infer=options, workers=2)
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    try:
        spread = augment(meshes, tmp_path / "ray", 2, infer=options, workers=2, engine="ray")
    finally:
        ray.shutdown()
    assert (spread.done, spread.ok, spread.failed) == (local.done, local.ok, local.failed)
    assert files(tmp_path / "ray") == files(tmp_path / "local")
