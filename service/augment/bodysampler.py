"""Draws for bodies: poses on the way from the source's to a real one, and other builds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from service.augment.distribution import Distribution
from service.augment.draw import Draw, some
from service.bodyinference import BodyInference
from service.edits import Change
from service.encode.bodymodel import TYPICAL_SPREAD
from service.template.anatomy import GROUPS, JOINTS, limits
from service.template.skinned import NAMES, SHAPES

Array = NDArray[np.float64]

FARTHEST_TURN = np.radians(30.0)
"""By which a joint turns at most."""
TYPICAL_TURN = np.radians(15.0)
"""Standard deviation of an angle where no real poses are known."""
DECIMALS = 5


class BodySampler:
    """Draws edits of one body: joints turn towards their places in a real-looking pose, within
    their reach; the shape goes towards a standard normal one.  How the body as a
    whole is turned stays."""

    def __init__(self, found: BodyInference):
        self._before = found.parameters
        self._turns = Rotation.from_matrix(found.fit.body.rotations[1:])
        vectors = self._before[: 3 * len(JOINTS)].reshape(-1, 3)[1:]
        low, high = limits()
        # What is beyond its reach already may stay there.
        self._low, self._high = np.minimum(low[1:], vectors), np.maximum(high[1:], vectors)
        self._distribution = Distribution.of(found.model)

    @property
    def real(self) -> bool:
        """Whether poses are like real ones; angles are independent otherwise."""
        return self._distribution is not None

    def draw(self, rng: np.random.Generator, strength: float) -> Draw:
        """Edits that go some of the way; see `AffineSampler.draw`."""
        goal, share = self._pose(rng), strength * some(rng)
        joints, shape = _subset(rng)
        steps = (self._turns.inv() * Rotation.from_rotvec(goal)).as_rotvec()
        length = np.linalg.norm(steps, axis=1, keepdims=True)
        wanted = np.minimum(share * length, strength * FARTHEST_TURN)
        steps *= wanted / np.maximum(length, np.finfo(float).tiny)
        vectors = (self._turns * Rotation.from_rotvec(steps)).as_rotvec()
        vectors = np.clip(_rounded(vectors), self._low, self._high)
        ends = np.clip(rng.standard_normal(SHAPES), -TYPICAL_SPREAD, TYPICAL_SPREAD)
        build = _rounded(self._before[-SHAPES:] + share * (ends - self._before[-SHAPES:]))
        after = np.concatenate([self._before[:3], vectors.ravel(), build])
        moves = np.concatenate([[False] * 3, np.repeat(joints, 3), [shape] * SHAPES])
        return Draw(
            {
                NAMES[index]: Change("set", float(after[index]))
                for index in np.flatnonzero(moves).tolist()
            },
            share,
        )

    def _pose(self, rng: np.random.Generator) -> Array:
        """``[23, 3]`` axis-angle vectors of a real-looking pose."""
        if self._distribution is None:
            vectors = self._turns.as_rotvec()
            return np.asarray(vectors + TYPICAL_TURN * rng.standard_normal(vectors.shape))
        drawn = self._distribution.draw(rng)
        return np.reshape([drawn[name] for name in NAMES[3 : 3 * len(JOINTS)]], (-1, 3))


def _rounded(values: Array) -> Array:
    return np.asarray(np.round(values, DECIMALS))


def _subset(rng: np.random.Generator) -> tuple[NDArray[np.bool_], bool]:
    """``[23]`` which joints turn, and whether the shape changes: half of the time all, else each
    limb and the shape with even odds."""
    chosen = np.ones(len(GROUPS) + 1, bool)
    if rng.random() < 0.5:
        chosen = rng.random(len(GROUPS) + 1) < 0.5
        chosen[rng.integers(len(GROUPS))] = True
    turning = {
        joint
        for joints, turns in zip(GROUPS.values(), chosen, strict=False)
        if turns
        for joint in joints
    }
    return np.array([joint in turning for joint in JOINTS[1:]]), bool(chosen[-1])
