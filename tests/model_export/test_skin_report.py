from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from model_export.rigs import Rig
from model_export.skin_report import (
    ANGLES,
    Score,
    edits,
    prepare,
    score_all,
    table,
    torn,
)
from service.template.anatomy import PARENTS
from service.template.bodyfile import load_body

TEMPLATE = load_body()
REST = TEMPLATE.at_rest()


def own_rig(off: float = 0.0) -> Rig:
    """The template as a rig of its own, its joints moved upward."""
    joints = TEMPLATE.joints + np.array([0.0, off, 0.0])
    worlds = np.tile(np.eye(4), (24, 1, 1))
    worlds[:, :3, 3] = joints
    order = np.argsort(-TEMPLATE.weights, axis=1, kind="stable")[:, :4]
    weights = np.take_along_axis(TEMPLATE.weights, order, axis=1)
    return Rig(
        points=TEMPLATE.decode(REST),
        faces=TEMPLATE.faces,
        bones=order,
        weights=weights,
        binds=np.linalg.inv(worlds),
        node=np.arange(24),
        worlds=worlds,
        parents=np.array(PARENTS),
        joints=np.arange(24),
        convention="own",
    )


@pytest.fixture(scope="module")
def scores():
    cases = list(prepare("own", own_rig(0.02), TEMPLATE, lambda *_: REST, ["rest"]))
    return score_all(cases, TEMPLATE)


def mean(scores, rule, field):
    return np.mean([getattr(score, field) for score in scores if score.rule == rule])


def test_every_edit_has_a_score_of_each_rule(scores):
    assert len(scores) == 4 * len(list(edits()))
    assert {score.angle for score in scores} == set(ANGLES)
    assert {score.joint for score in scores} >= {"left_elbow", "right_knee", "head", "spine2"}


def test_the_templates_own_weights_are_right_but_for_the_joints(scores):
    assert mean(scores, "nearest", "v2v_rig") < 1e-9
    assert mean(scores, "skin", "v2v_rig") < 0.3
    assert mean(scores, "inpainted", "v2v_rig") < 0.3
    assert mean(scores, "paper", "v2v_rig") > 0.5
    assert mean(scores, "nearest", "v2v") > 1.0


def test_mean_offsets_take_out_what_all_rigs_have_in_common(scores):
    assert mean(scores, "nearest", "v2v_offset") < 1e-9


def test_turned_bodies_have_the_same_offsets():
    cases = list(prepare("own", own_rig(0.02), TEMPLATE, lambda *_: REST, ["rest"]))
    turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    case = cases[0]
    moved = replace(
        case,
        rig=replace(case.rig, worlds=np.block([[turn, np.zeros((3, 1))],
                                               [np.zeros((1, 3)), np.ones((1, 1))]])
                    @ case.rig.worlds),
        fitted=case.fitted @ turn.T,
        turned=turn @ case.turned,
    )  # fmt: skip
    np.testing.assert_allclose(moved.offsets, case.offsets, atol=1e-9)


def test_torn_edges_are_counted_against_their_usual_length():
    lengths, usual = np.array([1.0, 9.0, 0.3, 0.5]), np.array([1.0, 2.0, 0.0, 0.0])
    assert torn(lengths, usual, short=0.1) == 50.0


def test_tables_are_means_and_ratios():
    one = Score("a", "rest", "head", "y", 30.0, "skin", 2.0, 1.0, 1.0, 0.0)
    scores = [one, replace(one, v2v=4.0), replace(one, rule="nearest", v2v=6.0, torn=1.5)]
    lines = table(scores, lambda score: score.character).splitlines()
    assert len(lines) == 3
    cells = [cell.strip() for cell in lines[2].strip("|").split("|")]
    assert cells == ["a", "3.00 / 1.00 / 1.00; 0.000", "6.00 / 1.00 / 1.00; 1.500",
                     "0.50 / 1.00 / 1.00"]  # fmt: skip
