"""``python tests/bench/differential OLD [NEW]``: the answers of two source trees to the same random questions."""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[3]
sys.path[:0] = [str(ROOT / "tests" / "bench")]

from differential.trees import start, tree_of  # noqa: E402


def main() -> int:
    """0, or 1 if the status of an answer differs."""
    parser = argparse.ArgumentParser(prog="python tests/bench/differential", description=__doc__)
    parser.add_argument("old", help="a folder that contains kin/, or a commit")
    parser.add_argument("new", nargs="?", default=str(ROOT), help="the same; by default this checkout")
    parser.add_argument("--questions", type=int, default=100_000, help="how many, over all arms (100 000)")
    parser.add_argument("--only", nargs="+", default=[], metavar="ARM", help="these arms only")
    parser.add_argument(
        "--numbers", nargs="+", type=int, metavar="N", help="these questions only, to each arm; print the answers"
    )
    arguments = parser.parse_args()
    try:
        old, new = tree_of(arguments.old), tree_of(arguments.new)
    except ValueError as error:
        parser.error(str(error))
    asked = {"count": arguments.questions, "only": arguments.only, "numbers": arguments.numbers}
    with tempfile.TemporaryDirectory() as folder:
        files = [f"{folder}/old", f"{folder}/new"]
        running = [
            start(tree, "answers", file, json.dumps(asked)) for tree, file in zip((old, new), files, strict=True)
        ]
        codes = [process.wait() for process in running]
        if any(codes):
            return 2
        print(file=sys.stderr)
        return start(new, "compare", *files, *["answers too"] * bool(arguments.numbers)).wait()


sys.exit(main())
