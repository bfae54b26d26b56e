from __future__ import annotations

import torch

from model_export.bodies import Garments, SyntheticBodies
from model_export.bodyerrors import joint_errors
from model_export.bodylosses import BodyLosses
from model_export.bodynet import BodyEncoder
from model_export.train_body import ordered
from service.template.skinned import SkinnedTemplate


def test_errors_are_in_millimetres(human: SkinnedTemplate) -> None:
    torch.manual_seed(0)
    encoder = BodyEncoder(16, 1, 6)
    batch = ordered(SyntheticBodies(human, Garments.none(), 0).batch(4, 160))
    errors = joint_errors(encoder, BodyLosses(human, 0), batch)
    assert 100 < errors["votes"] < 1500
    assert 100 < errors["posed"] < 1500
    assert 10 < errors["turn"] < 180
