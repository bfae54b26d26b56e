"""SIGHUP: look into the models folder and the file of keys again, without a restart.

A signal rather than a call: only who may signal the process can make it read the disk.
"""

from __future__ import annotations

import signal
import threading

import anyio
from anyio import to_thread

from service.api.keys import Keys
from service.api.readiness import Readiness


def can_listen() -> bool:
    """Whether this system has the signal, and this is the thread that may wait for it."""
    return hasattr(signal, "SIGHUP") and threading.current_thread() is threading.main_thread()


async def reload_on_hangup(readiness: Readiness, keys: Keys) -> None:
    """Reload the keys and the models at each SIGHUP, until cancelled."""
    with anyio.open_signal_receiver(signal.SIGHUP) as hangups:
        async for _ in hangups:
            await to_thread.run_sync(keys.reload)
            await readiness.reload()
