"""Coverage-guided search for a file that a reader fails on; see the package."""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from random import Random

import atheris
from atheris.import_hook import HookManager

# Without its tracing of comparisons, which never lets go of the array that comparing arrays gives.
with HookManager({"service"}, set(), enable_loader_override=True, trace_dataflow=False):
    from .corpus import formats, seeds
    from .mutations import mutate
    from .oracle import examine

MEGABYTES = 2048
"""Memory at which a file counts as a find."""
SECONDS = 10
"""Time after which one file counts as a find, with the readers instrumented."""


def main(arguments: list[str]) -> None:
    """Fuzz one format until the time is over (exit 0) or something is found (exit not 0)."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("format", choices=formats())
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--runs", type=int, default=-1, help="files at most; by default no limit")
    parser.add_argument("--seed", type=int, default=0, help="0 takes another each time")
    parser.add_argument("--keep", type=Path, default=Path(), help="folder for what is found")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as corpus:
        for number, data in enumerate(seeds(options.format)):
            (Path(corpus) / str(number)).write_bytes(data)
        flags = {
            "max_total_time": options.seconds, "runs": options.runs, "seed": options.seed,
            "max_len": 1 << 15, "timeout": SECONDS, "rss_limit_mb": MEGABYTES,
            "artifact_prefix": f"{options.keep}/", "verbosity": 0, "print_final_stats": 1,
        }  # fmt: skip
        atheris.Setup(
            [sys.argv[0], corpus, *(f"-{name}={value}" for name, value in flags.items())],
            lambda data: examine(data, options.format),
            custom_mutator=_mutated,
        )
        atheris.Fuzz()


def _mutated(data: bytes, longest: int, seed: int) -> bytes:
    """Damage that knows the formats, by turns with what the fuzzer's own mutations do."""
    random = Random(seed)
    if random.random() < 0.5:
        return bytes(atheris.Mutate(data, longest))
    return mutate(bytes(data), random)[:longest]


if __name__ == "__main__":
    main(sys.argv[1:])
