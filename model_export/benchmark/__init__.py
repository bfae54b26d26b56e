"""The benchmark: every rival on the same inputs, by the same measures."""
