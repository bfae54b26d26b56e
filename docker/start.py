"""Runs the service as a container's first process.

The system spares that one a SIGTERM that it does not handle, and the service handles it once it is
imported: until then this does, or a container that is stopped as it starts would have to be killed.
"""

import os
import signal
from runpy import run_module

signal.signal(signal.SIGTERM, lambda *_: os._exit(0))
run_module("service", run_name="__main__", alter_sys=True)
