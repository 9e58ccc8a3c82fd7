"""The benchmark: our arms against other libraries, in one interleaved run.

A *row* (:mod:`app.bench.rows`) is a task with targets; a *contestant* (:mod:`app.bench.contestants`) is one way of
one library to do it. Every contestant first answers all targets and is judged by our forward kinematics
(:mod:`app.bench.judge`); only then is it timed, in turns with all others (:mod:`app.bench.measure`), so that other
load on the machine affects all of them equally. :mod:`app.bench.gate` compares us with a floor of the same run.
"""

import os
from argparse import Namespace


def run_bench(arguments: Namespace) -> int:
    """``kinboard bench``; see `app.bench.command.bench`."""
    for name in ("OMP", "OPENBLAS", "MKL", "NUMEXPR"):  # read at import: every library uses one thread
        os.environ.setdefault(f"{name}_NUM_THREADS", "1")
    from app.bench.command import bench

    return bench(arguments)
