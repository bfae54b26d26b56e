"""What keeps a store from being opened."""

from __future__ import annotations


class StoreFault(Exception):
    """A setting of the store can't be followed; the message names it and says what to do."""
