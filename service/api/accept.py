"""Content negotiation: which of a few representations the Accept header asks for."""

from __future__ import annotations

from collections.abc import Sequence

Rank = tuple[float, int, int]


def negotiate(accept: str, offers: Sequence[str]) -> str:
    """The offered media type that the client likes best (RFC 9110, section 12.5.1).

    Quality decides; then a type that is named over one that a wildcard covers; then the order of
    the header; then the order of the offers.  A header that accepts no offer is disregarded, as
    the RFC allows: a mesh in an unasked-for type serves better than a 406.

    Args:
        accept: the header's value, empty when there was none.
        offers: media types without parameters, the default first.
    """
    ranges = [_parse(text) for text in (accept or "*/*").split(",") if text.strip()]
    ranks = [_rank(offer, ranges) for offer in offers]
    return offers[max(range(len(offers)), key=lambda index: (ranks[index], -index))]


def _parse(text: str) -> tuple[str, float]:
    """A media range, lower case and bare, and its quality."""
    name, *parameters = (part.strip().lower() for part in text.split(";"))
    quality = 1.0
    for parameter in parameters:
        key, _, value = parameter.partition("=")
        if key.strip() == "q":
            try:
                quality = min(max(float(value), 0.0), 1.0)
            except ValueError:
                quality = 0.0
    return name, quality


def _rank(offer: str, ranges: Sequence[tuple[str, float]]) -> Rank:
    """Quality, specificity and place of the most specific range that covers the offer."""
    covering = {offer: 2, offer.split("/")[0] + "/*": 1, "*/*": 0}
    matches = [
        (covering[name], -place, quality)
        for place, (name, quality) in enumerate(ranges)
        if name in covering
    ]
    if not matches:
        return 0.0, -1, -len(ranges)
    specificity, place, quality = max(matches)
    # What is refused by name comes even after what is not mentioned.
    return quality or -1.0, specificity, place
