"""Work that takes longer than a request should: kept, carried out in turn, and told of."""
