"""Labelled variants of a mesh, and of whole folders of them: random edits towards real shapes."""
