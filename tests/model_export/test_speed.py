from __future__ import annotations

import numpy as np
import pytest

from model_export.benchmark.speed import (
    BOUND,
    EDITS,
    FIRSTS,
    FLOOR,
    SIZES,
    WHOLE,
    Timing,
    apart,
    as_glb,
    copied,
    sized,
)
from model_export.benchmark.speedtable import speed_table
from service.mesh.formats import read_mesh
from service.stages import STAGES


@pytest.mark.parametrize(
    ("category", "size"), [("chair", 1_000), ("chair", 10_000), ("airplane", 10_000)]
)
def test_a_shape_has_about_the_size_that_is_asked_for(category: str, size: int) -> None:
    vertices, faces = sized(category, size)
    assert size / 2 < len(vertices) < 3 * size
    assert faces.max() == len(vertices) - 1
    assert len(read_mesh(as_glb((vertices, faces)), "a.glb").vertices) == len(vertices)


def test_a_copy_is_the_file() -> None:
    data = as_glb(sized("chair", 1_000))
    assert copied(data) == data


def test_half_and_nearly_all_keep_to_it() -> None:
    timing = Timing.of(np.arange(1.0, 102.0).tolist())
    assert (timing.p50, timing.p95) == (51.0, 96.0)


def test_every_size_is_measured_more_than_once() -> None:
    assert set(EDITS) == set(FIRSTS) == set(SIZES)
    assert min(*EDITS.values(), *FIRSTS.values()) > 1


def test_a_size_is_measured_in_a_process_of_its_own_and_told_in_a_table() -> None:
    row = apart("chair", 1_000, 1)
    assert {FLOOR, WHOLE, BOUND, "read", "encode", "refine", "bind", "transfer", "write"} <= set(
        row["stages"]
    )
    assert set(row["stages"]) <= {FLOOR, WHOLE, BOUND, *STAGES}
    assert all(0.0 < t["p50"] <= t["p95"] for t in row["stages"].values())
    assert row["memory"] > 2**26
    text = speed_table([row, row | {"threads": 2}])
    assert "## chair" in text
    lines = {line.split("|")[1].strip(): line for line in text.splitlines() if line.startswith("|")}
    for name in (BOUND, WHOLE, FLOOR, "refine"):
        assert lines[name].count(";") == 1, "with one thread and with two"
        assert lines[name].count("/") == 2
    assert int(lines["peak memory, MiB"].split("|")[2].split(";")[0]) > 64
