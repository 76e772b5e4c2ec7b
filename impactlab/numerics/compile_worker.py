"""A process that compiles functions and keeps them on disk: ``python -m impactlab.numerics.compile_worker``.

It reads pickled requests of `impactlab.numerics.compile_queue` from its input and writes a line for each.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import sys

from impactlab.numerics.ahead import compile_request
from impactlab.numerics.compile_queue import Request


def serve() -> None:
    """Compile the requests of the input until it ends."""
    asked, answers = sys.stdin.buffer, os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # prints of a compiler are not such a line
    while True:
        try:
            request = Request(*pickle.load(asked))  # noqa: S301 - from the process that started this one
        except EOFError:
            return
        with contextlib.suppress(Exception):  # the process that needs it compiles it then, and reports
            compile_request(request)
        answers.write(b"done\n")
        answers.flush()


if __name__ == "__main__":
    serve()
