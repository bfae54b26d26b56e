"""The mean body of a population and how bodies vary in stature, mass and sex.

People are drawn from MakeHuman's traits, far more diverse than any real population.  Vertices are
then regressed on stature, body mass index and sex together.  Stature is a difference of two
vertices' heights, thus linear in the vertices: the other two directions leave it as it is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model_export.body.makehuman import CHOICES, blend_weights
from service.template.anatomy import JOINTS

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

NAMES = ("Stature", "Body mass", "Masculinity")
MEAN = (1.70, 24.0, 0.5)
"""Of stature in metres, of body mass index in kg/m2, and of sex: 0 is female, 1 male."""
SPREAD = (0.11, 4.0, 0.41)
"""Standard deviations, which the shape coefficients count in."""
DENSITY = 985.0
"""Of a body with air in its lungs, in kg/m3."""
SAMPLES = 500
SEED = 20


@dataclass(frozen=True)
class Variation:
    """A mean body and its variation.

    Attributes:
        mean: ``[V, 3]`` vertices, and ``directions [V, 3, 3]`` for one standard deviation of each.
        joints: ``[24, 3]``, and ``joint_dirs [24, 3, 3]`` likewise.
    """

    mean: Array
    directions: Array
    joints: Array
    joint_dirs: Array


def draw_traits(generator: np.random.Generator) -> dict[str, Array]:
    """Traits of a random adult, for `MakeHuman.shaped`."""
    # As many are clearly women or men as are anything between.
    sex = generator.uniform() if generator.uniform() < 0.5 else float(generator.uniform() < 0.5)
    values = {
        "gender": sex,
        "age": 0.6 * generator.uniform(),
        "muscle": 0.25 + 0.5 * generator.uniform(),
        "weight": 0.1 + 0.85 * generator.uniform(),
        "height": 0.1 + 0.8 * generator.uniform(),
        "proportions": 0.4 + 0.4 * generator.uniform(),
    }
    traits = {trait: blend_weights(trait, value) for trait, value in values.items()}
    traits["origin"] = generator.dirichlet(np.ones(len(CHOICES["origin"])))
    return traits


def variation(
    body_of: Callable[[dict[str, Array]], tuple[Array, Array]], faces: Indices
) -> Variation:
    """Regress a population's bodies on their stature, body mass index and sex.

    Args:
        body_of: gives vertices ``[V, 3]`` and joints ``[24, 3]`` for traits, in a T-pose.
        faces: ``[F, 3]``.
    """
    stack, sexes = _people(body_of)
    count = stack.shape[1] - len(JOINTS)
    average = stack.mean(axis=0)[:count, 1]
    top, bottom = int(average.argmax()), int(average.argmin())
    statures = stack[:, top, 1] - stack[:, bottom, 1]
    masses = np.array([mass_index(body[:count], faces) for body in stack])
    centred = (np.column_stack([statures, masses, sexes]) - MEAN) / SPREAD
    design = np.column_stack([np.ones(len(stack)), centred])
    flat = stack.reshape(len(stack), -1)
    fitted = np.linalg.lstsq(design, flat, rcond=None)[0].astype(np.float64)
    fitted = fitted.reshape(4, -1, 3)
    mean: Array = fitted[0]
    directions: Array = fitted[1:].transpose(1, 2, 0)
    # Mass isn't linear in the vertices; the mean body's own is found step by step.
    for _ in range(10):
        lacking = MEAN[1] - mass_index(mean[:count], faces)
        mean = mean + directions[:, :, 1] * (lacking / SPREAD[1])
    # The same vertex of the soles is on the floor in every shape; the pelvis is over the origin.
    mean[:, 1] -= mean[bottom, 1]
    directions[:, 1] -= directions[bottom, 1]
    return Variation(mean[:count], directions[:count], mean[count:], directions[count:])


def _people(body_of: Callable[[dict[str, Array]], tuple[Array, Array]]) -> tuple[Array, Array]:
    """``[n, V + 24, 3]`` vertices and joints of random people, and ``[n]`` their sex."""
    generator = np.random.default_rng(SEED)
    bodies, sexes = [], []
    for _ in range(SAMPLES):
        traits = draw_traits(generator)
        vertices, joints = body_of(traits)
        origin = np.array([0.0, vertices[:, 1].min(), joints[0, 2]])
        bodies.append(np.concatenate([vertices, joints]) - origin)
        sexes.append(traits["gender"][1])
    return np.array(bodies), np.array(sexes)


def mass_index(vertices: Array, faces: Indices) -> float:
    """Body mass index in kg/m2 of an upright body."""
    stature = float(np.ptp(vertices[:, 1]))
    return DENSITY * volume(vertices, faces) / stature**2


def volume(vertices: Array, faces: Indices) -> float:
    """Volume inside a closed mesh, in cubic metres."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)
