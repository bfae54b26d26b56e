"""How many CPUs and how much memory this process may use: the container's, not the machine's."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from pathlib import Path, PurePosixPath


def cpu_count(root: Path = Path("/"), affinity: int | None = None) -> int:
    """Whole CPUs within the process's affinity and its cgroups' quotas, at least 1.

    A quota of a part of a CPU counts as a whole one.

    Args:
        root: where ``proc`` and ``sys`` are mounted.
        affinity: CPUs that the scheduler may use; by default asked of the system.
    """
    if affinity is None:
        affinity = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else None
    allowed = float(affinity or os.cpu_count() or 1)
    return max(1, math.ceil(min([allowed, *_quotas(root)])))


def memory_bytes(root: Path = Path("/"), physical: int | None = None) -> int:
    """Bytes of memory within the machine's and the limits of the process's cgroups.

    Args:
        root: where ``proc`` and ``sys`` are mounted.
        physical: the machine's own; by default asked of the system.
    """
    if physical is None:
        physical = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return min([physical, *_memory_limits(root)])


def _quotas(root: Path) -> Iterator[float]:
    """CPUs granted by each cgroup that the process is in, version 1 and 2."""
    for group in _groups(root):
        yield from _version_2(group)
    for group in _groups(root, "cpu"):
        yield from _version_1(group)


def _memory_limits(root: Path) -> Iterator[int]:
    """Bytes granted likewise; version 1 says that there is no limit by a huge one."""
    groups = [(group, "memory.max") for group in _groups(root)]
    groups += [(group, "memory.limit_in_bytes") for group in _groups(root, "memory")]
    for group, name in groups:
        limit = _read(group / name).strip()
        if limit and limit != "max":
            yield int(limit)


def _groups(root: Path, controller: str | None = None) -> Iterator[Path]:
    """Folders of the version 2 cgroups that the process is in, or of a version 1 controller's."""
    mount = root / "sys/fs/cgroup"
    for line in _read(root / "proc/self/cgroup").splitlines():
        _, controllers, path = line.split(":", 2)
        if controller is None and not controllers:
            yield from _ancestry(mount, path)
        elif controller is not None and controller in controllers.split(","):
            for name in dict.fromkeys((controller, controllers)):
                yield from _ancestry(mount / name, path)


def _ancestry(mount: Path, path: str) -> Iterator[Path]:
    """A cgroup's folder and all above it.

    Inside a container the path may be the host's while the mount shows the container's own group
    at its top; folders that are not there are read as without quota.
    """
    inner = PurePosixPath(path.lstrip("/"))
    for part in (inner, *inner.parents):
        yield mount / part


def _version_2(group: Path) -> Iterator[float]:
    match _read(group / "cpu.max").split():
        case [quota, period] if quota != "max":
            yield int(quota) / int(period)


def _version_1(group: Path) -> Iterator[float]:
    quota = _read(group / "cpu.cfs_quota_us").strip()
    period = _read(group / "cpu.cfs_period_us").strip()
    if quota and period and int(quota) > 0:
        yield int(quota) / int(period)


def _read(path: Path) -> str:
    try:
        return path.read_text("utf-8")
    except OSError:
        return ""
