"""Shapes in detail, with known parameters and their own true edit, to judge the transfer by.

Each is generated from its template's parameters and a style drawn once from a seed: running the
generator again with other parameters is the true edit, vertex by vertex.  What that edit does is
said in `chairs` and `airplanes`.  The families are disjoint from the shapes that encoders are
trained on.
"""

from model_export.detailed.airplanes import AIRPLANE_NAMES, detailed_airplane
from model_export.detailed.chairs import NAMES, DetailedChair, detailed_chair
from model_export.detailed.shape import DetailedShape

__all__ = [
    "AIRPLANE_NAMES",
    "NAMES",
    "DetailedChair",
    "DetailedShape",
    "detailed_airplane",
    "detailed_chair",
]
