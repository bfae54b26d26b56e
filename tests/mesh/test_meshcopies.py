from __future__ import annotations

import json
from typing import Any

from service.mesh.document import Document
from service.mesh.geometry import Use
from service.mesh.meshcopies import Repointing, pinned_accessors


def document(**members: Any) -> Document:
    return Document("gltf", json.dumps(members).encode())


MESH = {"name": "leg", "primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "material": 4}]}


def uses(*nodes: int) -> list[list[Use]]:
    """For each node, its two uses of the mesh."""
    return [
        [Use(node, 0, 0, "POSITION", 0, node), Use(node, 0, 0, "NORMAL", 1, node)] for node in nodes
    ]


def edits(repointing: Repointing) -> tuple[dict[Any, Any], list[Any]]:
    added: list[Any] = []

    def add(mesh: Any) -> int:
        added.append(mesh)
        return 10 + len(added)

    return repointing.edits(add), added


def test_nothing_assigned_is_nothing_changed() -> None:
    (one,) = uses(3)
    assert edits(Repointing(document(meshes=[MESH]), one)) == ({}, [])


def test_all_nodes_alike_change_the_mesh_itself() -> None:
    one, two = uses(3, 5)
    repointing = Repointing(document(meshes=[MESH]), one + two)
    repointing.assign([one[0], two[0]], 7)
    path = ("meshes", 0, "primitives", 0, "attributes", "POSITION")
    assert edits(repointing) == ({path: 7}, [])


def test_nodes_that_differ_get_copies() -> None:
    one, two, three = uses(3, 5, 6)
    repointing = Repointing(document(meshes=[MESH]), one + two + three)
    repointing.assign([two[0]], 7)
    repointing.assign([three[0], three[1]], 8)
    changes, added = edits(repointing)
    assert changes == {("nodes", 5, "mesh"): 11, ("nodes", 6, "mesh"): 12}
    assert [mesh["primitives"][0]["attributes"] for mesh in added] == [
        {"POSITION": 7, "NORMAL": 1},
        {"POSITION": 8, "NORMAL": 8},
    ]
    assert added[0]["primitives"][0]["material"] == 4
    assert MESH["primitives"][0]["attributes"] == {"POSITION": 0, "NORMAL": 1}


def test_pinned_are_all_other_uses() -> None:
    found = pinned_accessors(
        document(
            meshes=[
                {
                    "primitives": [
                        {
                            "attributes": {"POSITION": 0, "NORMAL": 1, "TANGENT": 2, "_OWN": 3},
                            "indices": 4,
                            "targets": [{"POSITION": 5}, {"NORMAL": 6}],
                        },
                        {"attributes": {"TEXCOORD_0": 7}},
                        "junk",
                    ]
                },
                None,
            ],
            skins=[{"inverseBindMatrices": 8}, {}],
            animations=[{"samplers": [{"input": 9, "output": 10}]}],
        )
    )
    assert found == {3, 4, 5, 6, 7, 8, 9, 10}
