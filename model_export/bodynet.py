"""The body's point encoder: a small point transformer that votes for the joints."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from service.encode.bodyoutputs import ANCHORS, OUTPUTS
from service.template.anatomy import JOINTS
from service.template.skinned import SHAPES

HEADS = 4


class BodyEncoder(nn.Module):
    """Joint positions, rotations, shape and scale of a body from its cloud.

    The cloud is cut into overlapping patches about anchors.  Each becomes a token: a PointNet of
    the patch, and where it is.  After attention among the tokens, each votes for where every joint
    is and says how much its vote is worth.  What the tokens that are heard know makes up a token of
    the joint, from which its rotation follows.
    """

    def __init__(
        self, width: int = 128, depth: int = 4, neighbours: int = 24, mean_log_scale: float = -0.5
    ) -> None:
        """
        Args:
            width: of the tokens.
            depth: layers of attention among the patches.
            neighbours: points a patch.
            mean_log_scale: natural logarithm of a usual scale, which a fresh network answers.
        """
        super().__init__()
        self.neighbours = neighbours
        self.patch = nn.Sequential(
            nn.Linear(3, width // 2), nn.ReLU(), nn.Linear(width // 2, width)
        )
        self.place = nn.Sequential(nn.Linear(3, width), nn.GELU(), nn.Linear(width, width))
        self.layers = nn.ModuleList(Attention(width) for _ in range(depth))
        self.norm = nn.LayerNorm(width)
        self.part = nn.Linear(width, len(JOINTS))
        self.worth = nn.Linear(width, len(JOINTS))
        self.vote = nn.Linear(width, 3 * len(JOINTS))
        self.heard = nn.Linear(width, width)
        self.joint_place = nn.Linear(3, width)
        self.joint_name = nn.Parameter(0.02 * torch.randn(len(JOINTS) + 1, width))
        self.whole = nn.Linear(2 * width, width)
        self.joint_layers = nn.ModuleList(Attention(width) for _ in range(2))
        self.joint_norm = nn.LayerNorm(width)
        self.rotation = nn.Linear(width, 6)
        self.rest = nn.Linear(width, SHAPES + 1)
        self.register_buffer("upright", torch.tensor([1.0, 0, 0, 0, 1, 0]))
        self.register_buffer("mean_rest", torch.tensor([0.0] * SHAPES + [mean_log_scale]))

    def forward(self, points: Tensor) -> Tensor:
        """``[B, n, 3]`` normalised clouds, the anchors first, to ``[B, OUTPUTS]``."""
        return self.answers(points)[0]

    def answers(self, points: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """``[B, OUTPUTS]``; ``[B, ANCHORS, 24]`` log odds of the part each anchor is on, and
        ``[B, ANCHORS, 24, 3]`` where each thinks that the joints are."""
        anchors = points[:, :ANCHORS]
        tokens = self.tokens(points, anchors)
        for layer in self.layers:
            tokens = layer(tokens)
        tokens = self.norm(tokens)
        worth = self.worth(tokens).float().softmax(dim=1).transpose(1, 2)
        offsets = 0.3 * self.vote(tokens).float().unflatten(2, (len(JOINTS), 3))
        votes = anchors[:, :, None] + offsets
        joints = (worth[..., None] * votes.transpose(1, 2)).sum(2)
        whole = self.whole(torch.cat([tokens.mean(1), tokens.amax(1)], dim=1))[:, None]
        heard = self.heard(worth.to(tokens.dtype) @ tokens) + self.joint_place(joints.detach())
        known = torch.cat([heard, whole], dim=1) + self.joint_name
        for layer in self.joint_layers:
            known = layer(known)
        known = self.joint_norm(known)
        six = self.rotation(known[:, :-1]).float() + self.upright
        rest = self.rest(known[:, -1]).float() + self.mean_rest
        outputs = torch.cat([joints.flatten(1), six.flatten(1), rest], dim=1)
        assert outputs.shape[1] == OUTPUTS
        return outputs, self.part(tokens).float(), votes

    def tokens(self, points: Tensor, anchors: Tensor) -> Tensor:
        """``[B, ANCHORS, width]`` of the patches."""
        squared = (anchors * anchors).sum(2)[:, :, None] + (points * points).sum(2)[:, None]
        # Not a matrix product, which autocast would round: the nearest have to be the nearest.
        products = [
            anchors[:, :, None, axis] * points[:, None, :, axis] for axis in range(points.shape[2])
        ]
        distance = squared - 2.0 * (products[0] + products[1] + products[2])
        nearest = distance.topk(self.neighbours, dim=2, largest=False).indices
        index = nearest.flatten(1)[..., None].expand(-1, -1, 3)
        patches = points.gather(1, index).unflatten(1, (ANCHORS, self.neighbours))
        relative = 8.0 * (patches - anchors[:, :, None])
        return self.patch(relative).max(dim=2).values + self.place(2.0 * anchors)


class Attention(nn.Module):
    """A transformer's layer, normalised beforehand: attention among tokens, then each alone."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.first, self.second = nn.LayerNorm(width), nn.LayerNorm(width)
        self.mix = nn.Linear(width, 3 * width)
        self.out = nn.Linear(width, width)
        self.alone = nn.Sequential(
            nn.Linear(width, 2 * width), nn.GELU(), nn.Linear(2 * width, width)
        )

    def forward(self, tokens: Tensor) -> Tensor:
        """``[B, t, width]`` to the same."""
        query, key, value = self.mix(self.first(tokens)).chunk(3, dim=2)
        heads = [part.unflatten(2, (HEADS, -1)).transpose(1, 2) for part in (query, key, value)]
        affinity = heads[0] @ heads[1].transpose(2, 3) * heads[0].shape[-1] ** -0.5
        mixed = affinity.softmax(dim=3) @ heads[2]
        tokens = tokens + self.out(mixed.transpose(1, 2).flatten(2))
        return tokens + self.alone(self.second(tokens))


def spread_first(points: Tensor, count: int) -> Tensor:
    """``[B, n, 3]`` clouds in another order: ``count`` points far from one another come first.

    Farthest-point sampling, beginning with each cloud's first point.
    """
    size = points.shape[1]
    rows = torch.arange(len(points), device=points.device)
    chosen = torch.zeros(len(points), count, dtype=torch.long, device=points.device)
    distance = torch.full(points.shape[:2], torch.inf, device=points.device)
    for index in range(1, count):
        last = points[rows, chosen[:, index - 1]]
        distance[rows, chosen[:, index - 1]] = -1.0  # never again, even among copies of one point
        distance = torch.minimum(distance, (points - last[:, None]).square().sum(2))
        chosen[:, index] = distance.argmax(dim=1)
    rest = torch.ones(points.shape[:2], dtype=torch.bool, device=points.device)
    rest.scatter_(1, chosen, False)
    others = rest.nonzero()[:, 1].view(len(points), size - count)
    return torch.cat([chosen, others], dim=1)
