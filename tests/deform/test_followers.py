from __future__ import annotations

import numpy as np
from boxes import PARAMETERS, chair
from planes import airplane, plane, plane_change, plane_values

from service.deform.followers import following


def test_it_is_the_template_there_and_goes_along_from_there():
    f = plane_values()
    np.testing.assert_allclose(plane().decode(f), airplane().decode(f), atol=1e-12)
    df = plane_change("vertical_stabilizer_length", 1.2) + plane_change("wing_length", 0.8)
    carried = airplane().following(f) @ df
    assert (carried != df).any()
    np.testing.assert_allclose(plane().decode(f + df), airplane().decode(f + carried), atol=1e-12)


def test_frames_and_tapers_go_along_with_the_vertices():
    f = plane_values() + plane_change("fuselage_length", 1.3)
    u = np.random.default_rng(0).uniform(-0.5, 0.5, (1, 6, 3))
    carried = plane_values() + airplane().following(plane_values()) @ (f - plane_values())
    np.testing.assert_allclose(
        plane().maps(f).place(u), airplane().maps(carried).place(u), atol=1e-12
    )


def test_a_template_without_followers_is_as_it_was():
    same = following(chair(), PARAMETERS)
    np.testing.assert_array_equal(same.jacobian, chair().jacobian)
    np.testing.assert_array_equal(same.frame_jacobian, chair().frame_jacobian)
    np.testing.assert_array_equal(same.frame_base, chair().frame_base)
