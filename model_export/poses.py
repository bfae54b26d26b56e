"""Random poses within anatomical reach: a wide prior for synthetic bodies.

Shoulders and hips are drawn as a direction of the limb and a twist about it, the other joints as
axis-angle vectors.  Everything is drawn for the left side; the right is its mirror image.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

from service.template.anatomy import JOINTS, limits
from service.template.skinning import rotation_matrices

LEFT, RIGHT = ("left", "right")
Directions = tuple[tuple[float, float, float], tuple[float, float, float]]

ARMS: dict[str, tuple[float, Directions]] = {
    "hanging": (0.34, ((0.30, -1.0, 0.0), (0.18, 0.10, 0.25))),
    "aside": (0.16, ((1.0, -0.35, 0.05), (0.10, 0.45, 0.30))),
    "raised": (0.12, ((0.45, 1.0, 0.15), (0.40, 0.30, 0.30))),
    "forward": (0.16, ((0.25, -0.15, 1.0), (0.35, 0.45, 0.20))),
    "bent": (0.12, ((0.45, -1.0, -0.10), (0.20, 0.25, 0.30))),
    "anywhere": (0.10, ((0.55, -0.10, 0.25), (0.60, 0.80, 0.70))),
}
"""What an upper arm does: how often, and mean and spread of its direction."""
LEGS: dict[str, tuple[float, Directions]] = {
    "standing": (0.50, ((0.06, -1.0, 0.03), (0.09, 0.05, 0.09))),
    "striding": (0.24, ((0.08, -1.0, 0.15), (0.12, 0.10, 0.50))),
    "seated": (0.14, ((0.15, -0.25, 1.0), (0.25, 0.40, 0.15))),
    "anywhere": (0.12, ((0.30, -0.70, 0.40), (0.45, 0.35, 0.55))),
}
"""What a thigh does, likewise."""
BOTH_LEGS = 0.6
"""Share of bodies whose legs do the same kind of thing."""


class Poses:
    """Draws joint rotations; the same seed draws the same ones."""

    def __init__(self, generator: torch.Generator) -> None:
        """
        Args:
            generator: source of randomness, of the device that poses are drawn on.
        """
        self.generator = generator
        self.device = generator.device
        low, high = limits()
        self.low = torch.as_tensor(low, dtype=torch.float32, device=self.device)
        self.high = torch.as_tensor(high, dtype=torch.float32, device=self.device)

    def draw(self, count: int) -> Tensor:
        """``[count, 24, 3, 3]`` rotations of the joints in their parents' frames; the root's is
        the identity."""
        vectors = self._slight(count)
        self._spine(vectors)
        rotations = rotation_matrices(vectors)
        legs = self._kinds(LEGS, count)
        others = self._kinds(LEGS, count)
        same = self._uniform(count) < BOTH_LEGS
        for side in (LEFT, RIGHT):
            arm = self._kinds(ARMS, count)
            leg = legs if side == LEFT else torch.where(same, legs, others)
            self._arm(rotations, vectors, side, arm)
            self._leg(rotations, vectors, side, leg)
        return rotations

    def _slight(self, count: int) -> Tensor:
        """``[count, 24, 3]`` every joint a little off its rest, about a fifth of its reach."""
        width = 0.18 * (self.high - self.low)
        vectors = width * self._normal(count, len(JOINTS), 3)
        vectors[:, 0] = 0.0
        return torch.maximum(torch.minimum(vectors, self.high), self.low)

    def _spine(self, vectors: Tensor) -> None:
        """Some bend forward, together at all joints of the spine; most stand nearly straight."""
        count = len(vectors)
        bend = torch.where(self._uniform(count) < 0.2, self._uniform(count), torch.tensor(0.0))
        for name in ("spine1", "spine2", "spine3"):
            joint = JOINTS.index(name)
            vectors[:, joint] *= 0.6
            vectors[:, joint, 0] += 0.8 * bend * self.high[joint, 0]

    def _arm(self, rotations: Tensor, vectors: Tensor, side: str, kinds: Tensor) -> None:
        count = len(kinds)
        direction = self._directions(ARMS, kinds)
        twist = math.radians(28) * self._normal(count)
        shoulder = _swing((1.0, 0.0, 0.0), direction) @ _about("x", twist)
        # A raised arm takes its collar bone along.
        lift = torch.clamp(direction[:, 1] + 0.2, min=0.0) * math.radians(18)
        collar = vectors[:, JOINTS.index(f"{LEFT}_collar")].clone()
        collar[:, 2] = 0.5 * collar[:, 2] + lift
        much = kinds >= list(ARMS).index("forward")
        most = self.low[JOINTS.index("left_elbow"), 1]
        bend = torch.where(much, self._uniform(count) ** 0.7, 0.45 * self._uniform(count) ** 1.5)
        straight = (self._uniform(count) < 0.25).float()
        elbow = torch.stack(
            [
                math.radians(25) * self._normal(count),
                bend * most * (1.0 - 0.9 * straight),
                math.radians(4) * self._normal(count),
            ],
            dim=1,
        )
        self._set(rotations, side, "shoulder", shoulder)
        self._set(rotations, side, "collar", rotation_matrices(collar))
        self._set(rotations, side, "elbow", rotation_matrices(elbow))

    def _leg(self, rotations: Tensor, vectors: Tensor, side: str, kinds: Tensor) -> None:
        count = len(kinds)
        direction = self._directions(LEGS, kinds)
        twist = math.radians(14) * self._normal(count)
        hip = _swing((0.0, -1.0, 0.0), direction) @ _about("y", twist)
        standing = kinds == list(LEGS).index("standing")
        seated = kinds == list(LEGS).index("seated")
        most = self.high[JOINTS.index("left_knee"), 0]
        usual = torch.where(standing, 0.12 * self._normal(count).abs(), self._uniform(count) ** 1.3)
        bend = torch.where(seated, 0.62 + 0.22 * self._normal(count), usual)
        knee = torch.stack(
            [
                torch.clamp(bend, 0.0, 1.0) * most,
                math.radians(5) * self._normal(count),
                math.radians(2.5) * self._normal(count),
            ],
            dim=1,
        )
        self._set(rotations, side, "hip", hip)
        self._set(rotations, side, "knee", rotation_matrices(knee))

    def _set(self, rotations: Tensor, side: str, name: str, left: Tensor) -> None:
        """Give a joint of one side a rotation that was drawn for the left one."""
        mirror = torch.diag(torch.tensor([-1.0, 1.0, 1.0], device=self.device))
        turned = left if side == LEFT else mirror @ left @ mirror
        rotations[:, JOINTS.index(f"{side}_{name}")] = turned

    def _kinds(self, table: dict[str, tuple[float, Directions]], count: int) -> Tensor:
        shares = torch.tensor([share for share, _ in table.values()], device=self.device)
        return torch.multinomial(shares, count, replacement=True, generator=self.generator)

    def _directions(self, table: dict[str, tuple[float, Directions]], kinds: Tensor) -> Tensor:
        ends = torch.tensor([list(d) for _, d in table.values()], device=self.device)
        drawn = ends[kinds, 0] + ends[kinds, 1] * self._normal(len(kinds), 3)
        return torch.nn.functional.normalize(drawn, dim=1)

    def _normal(self, *size: int) -> Tensor:
        return torch.randn(*size, generator=self.generator, device=self.device)

    def _uniform(self, *size: int) -> Tensor:
        return torch.rand(*size, generator=self.generator, device=self.device)


def _swing(start: tuple[float, float, float], ends: Tensor) -> Tensor:
    """``[n, 3, 3]`` least rotations that take a unit vector to others ``[n, 3]``."""
    first = torch.tensor(start, device=ends.device).expand_as(ends)
    axis = torch.cross(first, ends, dim=1)
    sine = axis.norm(dim=1, keepdim=True)
    angle = torch.atan2(sine, (first * ends).sum(dim=1, keepdim=True))
    return rotation_matrices(axis / sine.clamp_min(1e-9) * angle)


def _about(axis: str, angles: Tensor) -> Tensor:
    """``[n, 3, 3]`` rotations about an axis."""
    vectors = torch.zeros(len(angles), 3, device=angles.device)
    vectors[:, "xyz".index(axis)] = angles
    return rotation_matrices(vectors)
