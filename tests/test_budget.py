from __future__ import annotations

from service.budget import AT_REST_BYTES, LEAST_VERTICES, VERTEX_BYTES, Budget

MIB = 1 << 20


def test_a_share_is_an_eighth_up_to_a_bound() -> None:
    assert Budget(512 * MIB).share(None) == 64 * MIB
    assert Budget(64 << 30).share(None) == 256 * MIB
    assert Budget(64 << 30).share(0) == 0
    assert Budget(MIB).share(7) == 7


def test_all_workers_have_room_for_the_largest_mesh() -> None:
    budget = Budget(2048 * MIB)
    for workers in (1, 2, 5):
        count = budget.vertices(workers, 100 * MIB)
        taken = AT_REST_BYTES + 100 * MIB + workers * count * VERTEX_BYTES
        assert taken <= budget.bytes < taken + workers * VERTEX_BYTES


def test_small_meshes_are_taken_in_any_case() -> None:
    assert Budget(MIB).vertices(4, 0) == LEAST_VERTICES
