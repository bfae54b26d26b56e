from __future__ import annotations

from service.memory import AT_REST_BYTES, LEAST_VERTICES, VERTEX_BYTES, Memory

MIB = 1 << 20


def test_a_share_is_an_eighth_up_to_a_bound() -> None:
    assert Memory(512 * MIB).share(None) == 64 * MIB
    assert Memory(64 << 30).share(None) == 256 * MIB
    assert Memory(64 << 30).share(0) == 0
    assert Memory(MIB).share(7) == 7


def test_all_workers_have_room_for_the_largest_mesh() -> None:
    memory = Memory(2048 * MIB)
    for workers in (1, 2, 5):
        count = memory.vertices(workers, 100 * MIB)
        taken = AT_REST_BYTES + 100 * MIB + workers * count * VERTEX_BYTES
        assert taken <= memory.bytes < taken + workers * VERTEX_BYTES


def test_small_meshes_are_taken_in_any_case() -> None:
    assert Memory(MIB).vertices(4, 0) == LEAST_VERTICES
