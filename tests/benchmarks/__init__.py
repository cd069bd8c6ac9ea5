"""Benchmarks: ERSATZ beside what a user would take instead, on the same work, in the same run.

One command runs all and writes the table as Markdown and JSON:

    python -m tests.benchmarks [--quick] [--only NAME]... [--out DIR] [--readme]

`--readme` writes the table to `results/`, and the rows that have a target into the README.

The convention: a module `tests/benchmarks/bench_<name>.py` with a function `run(quick: bool) -> list[Row]`
is part of the run; there is no other list. `quick` asks for sizes that take seconds. `measuring.race`
times ERSATZ and its rivals in turns, so that a busy machine slows both, and gives the rows. Before it
times anything a benchmark asserts that the rivals' answers are equal. A rival whose package is not
installed (`pip install -e '.[test,bench]'` has them all) is a row without figures. Nothing here is a test,
and no test fails on a time.
"""
