"""Threads that stand back behind others."""

from __future__ import annotations

import os
import sys
import threading

LEAST = 19
"""The niceness of what has all the time in the world."""

_this_thread = threading.local()


def stand_back(by: int) -> None:
    """Lower this thread's priority, once; where a thread has none of its own, nothing happens."""
    if sys.platform == "linux" and not getattr(_this_thread, "stands_back", False):
        thread = threading.get_native_id()
        niceness = os.getpriority(os.PRIO_PROCESS, thread) + by
        os.setpriority(os.PRIO_PROCESS, thread, min(niceness, LEAST))
        _this_thread.stands_back = True
