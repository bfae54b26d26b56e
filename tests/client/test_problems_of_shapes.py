"""Problems that take a category with rules of its own: what a chair is, and may be."""

from __future__ import annotations

from typing import Any

import httpx
import numpy as np
import pytest
import trimesh
from provoke import BOX, client_of, provokes, refused
from trimesh.transformations import translation_matrix

from service.client import ShapeClient


@pytest.fixture(scope="module")
def client(service_client: httpx.Client) -> ShapeClient:
    """A client of the service as it is installed."""
    return client_of(service_client)


def airplane() -> bytes:
    """A cylinder with wings and a tail, the nose along +z."""
    mesh = trimesh.util.concatenate(
        [
            trimesh.creation.cylinder(0.5, 8, transform=np.eye(4)),
            trimesh.creation.box((9, 0.2, 1)),
            trimesh.creation.box((3, 0.1, 0.6), transform=translation_matrix([0, 0, -3.6])),
            trimesh.creation.box((0.1, 1.5, 0.6), transform=translation_matrix([0, 0.75, -3.6])),
        ]
    )
    return bytes(mesh.export(file_type="glb"))


@provokes(categories_differ=422)
def test_a_chair_with_wings(client: ShapeClient, chair_glb: bytes) -> Any:
    return refused(lambda: client.transfer(chair_glb, airplane(), refine=False))


@provokes(not_recognised=422)
def test_a_box_is_no_chair(client: ShapeClient) -> Any:
    return refused(lambda: client.edit(BOX, {"seat_width": 0.5}, refine=False))


@provokes(edit_out_of_bounds=422)
def test_legs_that_would_meet(client: ShapeClient, chair_glb: bytes) -> Any:
    return refused(lambda: client.edit(chair_glb, {"leg_width": 0.3}, strict=True))
