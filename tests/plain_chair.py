"""The ordinary chair that tests across the project measure and edit."""

from __future__ import annotations

PLAIN = {
    "back_height": 0.42,
    "back_thickness": 0.04,
    "seat_thickness": 0.06,
    "seat_depth": 0.45,
    "seat_width": 0.48,
    "leg_height": 0.40,
    "leg_depth": 0.05,
    "leg_width": 0.05,
}
"""Its parameters in metres, in the order of the paper's template."""
