"""How far off the body's encoder is by itself, while it trains."""

from __future__ import annotations

import torch

from model_export.bodies import BodyBatch
from model_export.bodylosses import BodyAnswer, BodyLosses
from model_export.bodynet import BodyEncoder
from service.template.anatomy import PARENTS
from service.template.skinning import pose_joints


@torch.no_grad()
def joint_errors(encoder: BodyEncoder, losses: BodyLosses, batch: BodyBatch) -> dict[str, float]:
    """Mean joint error in millimetres, and median rotation error in degrees.

    ``votes`` are the joints as they are voted for, ``posed`` those of the answered pose, ``turn``
    is of the rotations in space.
    """
    encoder.eval()
    answer = BodyAnswer.of(torch.cat([encoder(chunk) for chunk in batch.points.split(32)]))
    rest = losses.joints + torch.einsum("jck,bk->bjc", losses.joint_dirs, answer.shape)
    placed = pose_joints(answer.rotations, rest, PARENTS)[1] - rest[:, :1]
    posed = answer.scale[:, None, None] * placed + answer.votes[:, :1]
    turned, _ = pose_joints(batch.rotations, batch.joints, PARENTS)
    metre = batch.scale[:, None]
    cosine = ((answer.turned.transpose(2, 3) @ turned).diagonal(dim1=2, dim2=3).sum(2) - 1) / 2
    return {
        "votes": 1000 * ((answer.votes - batch.joints).norm(dim=2) / metre).mean().item(),
        "posed": 1000 * ((posed - batch.joints).norm(dim=2) / metre).mean().item(),
        "turn": torch.rad2deg(torch.acos(cosine.clamp(-1, 1))).median().item(),
    }
