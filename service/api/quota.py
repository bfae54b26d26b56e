"""How many CPUs this process may use: a container's quota, not the machine's count."""

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


def _quotas(root: Path) -> Iterator[float]:
    """CPUs granted by each cgroup that the process is in, version 1 and 2."""
    mount = root / "sys/fs/cgroup"
    for line in _read(root / "proc/self/cgroup").splitlines():
        _, controllers, path = line.split(":", 2)
        if not controllers:
            for group in _ancestry(mount, path):
                yield from _version_2(group)
        elif "cpu" in controllers.split(","):
            for name in ("cpu", controllers):
                for group in _ancestry(mount / name, path):
                    yield from _version_1(group)


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
