"""`python -m service.newkey NAME`: a fresh API key, and the entry that lets it in."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from service.api.keys import NAME, Entry, digest_of, new_key


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the key on one line and its entry on the next; what they are goes to standard error."""
    parser = argparse.ArgumentParser(prog="python -m service.newkey", description=__doc__)
    parser.add_argument("name", help="whose key it is: letters, digits, `.`, `_` and `-`")
    name = parser.parse_args(arguments).name
    if not NAME.fullmatch(name):
        parser.error("NAME must be 1 to 64 letters, digits, `.`, `_` or `-`")
    key = new_key()
    print("The key, for the client; nothing keeps it:", file=sys.stderr, flush=True)
    print(key, flush=True)
    print("Its entry, for API_KEYS or a line of API_KEYS_FILE:", file=sys.stderr, flush=True)
    print(Entry(name, digest_of(key)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
