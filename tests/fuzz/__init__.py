"""Broken and hostile files against the readers, the writers and the service.

    python -m tests.fuzz FORMAT [--seconds N] [--runs N] [--seed S] [--keep DIR]

looks for a file that one reader fails on, guided by coverage (atheris).  FORMAT is glb, gltf,
obj, ply, stl, off or zip.  `test_fuzz.py` does so for a moment a format in every run of the tests;
run it by hand for minutes or hours after a change of a reader.  A file that fails is written to DIR
(by default the working directory) as ``crash-...``, ``timeout-...`` or ``oom-...``; hand it to
`oracle.examine` to see what is wrong, and make it a test of the reader's own test file.

    python -m tests.fuzz.storm [FORMAT ...] [--files N] [--requests N] [--live N] [--folder DIR]

damages files of a folder (by default small generated ones) at random and sends them through
readers and writers, through the app in this process, and through a server on loopback.  It tells
how they were answered, the slowest answers and the growth of memory, and fails on anything that
an operator would have to look into.

What is held of every file, damaged or not, is in `oracle.py`: an answer or a ShapeError, in time,
within memory; unmoved vertices give the same bytes; moved ones give a file that reads again.
`HYPOTHESIS_PROFILE=long` makes the property tests try a hundred times as many examples.
"""
