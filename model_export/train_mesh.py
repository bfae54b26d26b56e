"""Train the body's mesh encoder: ``python -m model_export.train_mesh``, then export it likewise."""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor
from tqdm import tqdm

from model_export.bodylosses import geodesic_squared
from model_export.meshnet import MeshNet
from model_export.onnxfile import write_network
from model_export.poses import Poses
from service.encode.alignment import align
from service.encode.meshencoder import torso_weights
from service.mesh.surface import RADIUS
from service.template.anatomy import JOINTS, PARENTS
from service.template.bodyfile import load_body
from service.template.skinned import SHAPES, SkinnedTemplate
from service.template.skinning import orthonormal, pose_joints, skin

NOISE, CLOTH = 0.004, 0.015
"""Largest noise of vertices and largest smooth offset from the skin, in metres."""
WAVES = 4


class MeshBodies:
    """Draws bodies with all of their vertices, in the template's order, the torso upright."""

    def __init__(self, template: SkinnedTemplate, seed: int) -> None:
        """The same seed draws the same ones."""
        self.generator = torch.Generator().manual_seed(seed)
        self.poses = Poses(self.generator)
        self.rest, self.shapedirs, self.joints, self.joint_dirs, self.weights = (
            torch.as_tensor(array, dtype=torch.float32)
            for array in (template.rest, template.shapedirs, template.joints,
                          template.joint_dirs, template.weights)
        )  # fmt: skip
        self.torso = torch.as_tensor(torso_weights(template), dtype=torch.float32)

    def batch(self, count: int) -> tuple[Tensor, Tensor, Tensor]:
        """``[count, V, 3]`` normalised vertices, ``[count, 24, 3, 3]`` rotations of the joints in
        that space, and ``[count, 3]`` shapes."""
        shape = 1.15 * torch.randn(count, SHAPES, generator=self.generator)
        rest = self.rest + torch.einsum("vck,bk->bvc", self.shapedirs, shape)
        rest = rest + self._offsets(count)
        joints = self.joints + torch.einsum("jck,bk->bjc", self.joint_dirs, shape)
        turned, placed = pose_joints(self.poses.draw(count), joints, PARENTS)
        posed = skin(rest, self.weights, joints, turned, placed)
        noise = torch.rand(count, 1, 1, generator=self.generator)
        posed = posed + NOISE * noise * torch.randn(posed.shape, generator=self.generator)
        turn, _, _ = align(posed, self.rest, self.torso)
        upright = posed @ turn.transpose(1, 2)
        away = upright - upright.mean(dim=1, keepdim=True)
        radius = away.norm(dim=2).amax(dim=1)[:, None, None]
        return RADIUS * away / radius, turn[:, None] @ turned, shape

    def _offsets(self, count: int) -> Tensor:
        """``[count, V, 3]`` smooth displacements of the surface."""
        draw = torch.randn(count, WAVES, 6, generator=self.generator)
        phase = 2 * math.pi * torch.rand(count, WAVES, 1, generator=self.generator)
        waves = torch.sin(8.0 * self.rest @ draw[..., :3].transpose(1, 2) + phase.transpose(1, 2))
        return CLOTH / WAVES * waves @ draw[..., 3:]


def turns_of(outputs: Tensor) -> Tensor:
    """``[B, 24, 3, 3]`` rotations in space of the network's outputs."""
    return orthonormal(outputs[:, : 6 * len(JOINTS)].unflatten(1, (len(JOINTS), 6)))


def loss_of(outputs: Tensor, turned: Tensor, shape: Tensor) -> Tensor:
    """Squared geodesic distance of the rotations (section 4.3), and squared error of the shape."""
    own = turns_of(outputs)
    parents = list(PARENTS[1:])
    local, truth = (t[:, parents].transpose(2, 3) @ t[:, 1:] for t in (own, turned))
    angles = geodesic_squared(own, turned).mean() + geodesic_squared(local, truth).mean()
    return angles + 0.1 * (outputs[:, -SHAPES:] - shape).square().mean()


def train(
    template: SkinnedTemplate, folder: Path, steps: int, batch: int, resume: bool, seed: int = 0
) -> dict[str, Any]:
    """Train to the end, with a checkpoint and a log line every so often; the last checkpoint."""
    torch.manual_seed(seed)
    network = MeshNet(template.faces, len(template.rest))
    bodies = MeshBodies(template, seed)
    optimizer = torch.optim.AdamW(network.parameters(), 2e-3, weight_decay=1e-3)
    state: dict[str, Any] = {"step": 0, "seconds": 0.0}
    folder.mkdir(parents=True, exist_ok=True)
    if resume:
        state = torch.load(folder / "checkpoint.pt")
        network.load_state_dict(state["network"])
        optimizer.load_state_dict(state["optimizer"])
        bodies.generator.set_state(state["random"])
    began, mean = time.monotonic() - state["seconds"], 0.0
    bar = tqdm(range(state["step"], steps), initial=state["step"], total=steps, mininterval=10.0)
    for step in bar:
        rate = 2e-3 * min(1.0, (step + 1) / 50) * (0.5 + 0.5 * math.cos(math.pi * step / steps))
        for group in optimizer.param_groups:
            group["lr"] = rate
        vertices, turned, shape = bodies.batch(batch)
        with torch.autocast("cpu", torch.bfloat16):
            outputs = network(vertices)
        loss = loss_of(outputs, turned, shape)
        optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimizer.step()
        mean = loss.item() if not mean else 0.95 * mean + 0.05 * loss.item()
        if (step + 1) % 100 == 0 or step + 1 == steps:
            state = {
                "network": network.state_dict(),
                "optimizer": optimizer.state_dict(),
                "random": bodies.generator.get_state(),
                "template": template.digest,
                "step": step + 1,
                "batch": batch,
                "seconds": time.monotonic() - began,
                "place": f"CPU, threads: {torch.get_num_threads()}",
            }
            torch.save(state, folder / "checkpoint.part")
            (folder / "checkpoint.part").replace(folder / "checkpoint.pt")
            line = {"step": step + 1, "seconds": round(state["seconds"]), "loss": round(mean, 4)}
            with (folder / "log.jsonl").open("a") as log:
                log.write(json.dumps(line) + "\n")
            bar.set_postfix_str(f"loss {mean:.3g}", refresh=False)
    return state


def write_onnx(network: MeshNet, count: int, path: Path) -> None:
    """Write the network: input ``vertices [1, V, 3]``, output ``outputs``."""
    write_network(network, 0.1 * torch.randn(1, count, 3), path, ("vertices", "outputs"))


@torch.no_grad()
def median_error(network: MeshNet, template: SkinnedTemplate, count: int) -> float:
    """Median angle in degrees between answered and true rotations in space of fresh bodies."""
    bodies = MeshBodies(template, 20_000_003)
    angles = []
    for _ in range(count):
        vertices, turned, _ = bodies.batch(1)
        angles.append(geodesic_squared(turns_of(network.eval()(vertices)), turned).sqrt())
    return float(np.degrees(torch.cat(angles).median().item()))


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.train_mesh", description=__doc__)
    parser.add_argument("--body", type=Path, help="body file (default: the shipped body)")
    parser.add_argument("--out", type=Path, default=Path("runs/human-mesh"), help="of the run")
    parser.add_argument("--steps", type=int, default=1200)
    parser.add_argument("--batch", type=int, default=4)
    parser.add_argument("--threads", type=int, help="CPU threads (default: all)")
    parser.add_argument("--resume", action="store_true", help="go on from the last checkpoint")
    arguments = parser.parse_args()
    if arguments.threads:
        torch.set_num_threads(arguments.threads)
    template = load_body(arguments.body)
    train(template, arguments.out, arguments.steps, arguments.batch, arguments.resume)


if __name__ == "__main__":
    main()
