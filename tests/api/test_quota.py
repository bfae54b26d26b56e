from __future__ import annotations

from pathlib import Path

import pytest

from service.api.quota import cpu_count, memory_bytes


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A system with no cgroups."""
    (tmp_path / "proc/self").mkdir(parents=True)
    return tmp_path


def write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def test_without_cgroups_the_affinity_counts(root: Path) -> None:
    assert cpu_count(root, affinity=6) == 6


@pytest.mark.parametrize(
    ("cpu_max", "expected"),
    [
        ("max 100000\n", 8),
        ("200000 100000\n", 2),
        ("150000 100000\n", 2),
        ("20000 100000\n", 1),
        ("3200000 100000\n", 8),
    ],
)
def test_version_2_quota_at_the_top_of_a_container(root: Path, cpu_max: str, expected: int) -> None:
    write(root / "proc/self/cgroup", "0::/\n")
    write(root / "sys/fs/cgroup/cpu.max", cpu_max)
    assert cpu_count(root, affinity=8) == expected


def test_version_2_takes_the_least_quota_of_all_ancestors(root: Path) -> None:
    write(root / "proc/self/cgroup", "0::/pods/service/worker\n")
    write(root / "sys/fs/cgroup/pods/cpu.max", "300000 100000\n")
    write(root / "sys/fs/cgroup/pods/service/cpu.max", "500000 100000\n")
    write(root / "sys/fs/cgroup/pods/service/worker/cpu.max", "max 100000\n")
    assert cpu_count(root, affinity=8) == 3


@pytest.mark.parametrize(("quota", "expected"), [("-1", 8), ("400000", 4), ("50000", 1)])
@pytest.mark.parametrize("folder", ["cpu", "cpu,cpuacct"])
def test_version_1_quota_seen_from_inside_a_container(
    root: Path, folder: str, quota: str, expected: int
) -> None:
    # The path is the host's; the mount shows the container's own group at its top.
    write(root / "proc/self/cgroup", "5:memory:/docker/ab\n4:cpu,cpuacct:/docker/ab\n")
    write(root / f"sys/fs/cgroup/{folder}/cpu.cfs_quota_us", f"{quota}\n")
    write(root / f"sys/fs/cgroup/{folder}/cpu.cfs_period_us", "100000\n")
    assert cpu_count(root, affinity=8) == expected


def test_this_machine_has_a_cpu() -> None:
    assert cpu_count() >= 1


GIB = 1 << 30


def test_without_cgroups_the_machines_memory_counts(root: Path) -> None:
    assert memory_bytes(root, physical=4 * GIB) == 4 * GIB


@pytest.mark.parametrize(
    ("limit", "expected"),
    [("max\n", 4 * GIB), ("536870912\n", GIB // 2), (f"{16 * GIB}\n", 4 * GIB)],
)
def test_version_2_memory_limit(root: Path, limit: str, expected: int) -> None:
    write(root / "proc/self/cgroup", "0::/\n")
    write(root / "sys/fs/cgroup/memory.max", limit)
    assert memory_bytes(root, physical=4 * GIB) == expected


def test_version_2_takes_the_least_memory_of_all_ancestors(root: Path) -> None:
    write(root / "proc/self/cgroup", "0::/pods/service\n")
    write(root / "sys/fs/cgroup/pods/memory.max", f"{GIB}\n")
    write(root / "sys/fs/cgroup/pods/service/memory.max", f"{2 * GIB}\n")
    assert memory_bytes(root, physical=4 * GIB) == GIB


@pytest.mark.parametrize(
    ("limit", "expected"),
    [("9223372036854771712\n", 4 * GIB), ("536870912\n", GIB // 2)],
)
def test_version_1_memory_limit_seen_from_inside_a_container(
    root: Path, limit: str, expected: int
) -> None:
    write(root / "proc/self/cgroup", "5:memory:/docker/ab\n4:cpu,cpuacct:/docker/ab\n0::/\n")
    write(root / "sys/fs/cgroup/memory/memory.limit_in_bytes", limit)
    assert memory_bytes(root, physical=4 * GIB) == expected


def test_this_machine_has_memory() -> None:
    assert memory_bytes() > 64 << 20
