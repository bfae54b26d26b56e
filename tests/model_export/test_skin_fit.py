from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from model_export.skin_fit import fit_joints, served_fit
from service.encode.model import SHIPPED, load_models
from service.template.anatomy import JOINTS
from service.template.bodyfile import load_body

TEMPLATE = load_body()


@pytest.mark.parametrize("missing", [[], ["left_hand", "right_hand", "spine2"]])
def test_a_fit_that_is_told_the_joints_is_near(missing):
    rest = TEMPLATE.at_rest()
    rotations = rest.rotations.copy()
    rotations[JOINTS.index("left_shoulder")] = [[0.6, 0.8, 0], [-0.8, 0.6, 0], [0, 0, 1]]
    body = replace(rest, rotations=rotations, scale=100.0, translation=np.array([3.0, 90.0, 5.0]))
    told = TEMPLATE.posed_joints(body)
    told[[JOINTS.index(name) for name in missing]] = np.nan
    fit = fit_joints(TEMPLATE)(TEMPLATE.decode(body), TEMPLATE.faces, told)
    off = np.linalg.norm(TEMPLATE.posed_joints(fit) - TEMPLATE.posed_joints(body), axis=1)
    assert off.mean() < 1.0
    assert fit.scale == pytest.approx(100.0, rel=0.05)


def test_the_services_own_fit_is_in_the_files_frame():
    model = load_models(SHIPPED)["human"]
    rest = TEMPLATE.at_rest()
    body = replace(rest, scale=100.0, translation=np.array([3.0, 90.0, 5.0]))
    unknown = np.full((len(JOINTS), 3), np.nan)
    fit = served_fit(model)(TEMPLATE.decode(body), TEMPLATE.faces, unknown)
    off = np.linalg.norm(TEMPLATE.posed_joints(fit) - TEMPLATE.posed_joints(body), axis=1)
    assert off.mean() < 2.0
