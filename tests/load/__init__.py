"""Load on the service: `python -m tests.load`, and for its memory `python -m tests.load.soak`.

On loopback alone, bounded in time and in requests.  The clients share the machine's CPUs with the
service that they measure; they are plain sockets on one event loop, so that they take little.
"""
