"""`python -m tests.benchmarks [NAME ...]`: the tables of `make bench`, all of `NAMES` if none is named.

Those of `LONG` are made only when they are named: they take many minutes, or keep a record, or compare with one.
"""

from __future__ import annotations

import importlib
import os
import sys

NAMES = ("sets", "supervisor", "loop", "tick", "layers", "sweep")
LONG = ("recoverability", "rate", "bits", "loop_kept", "loop_check")
# What has its own name, and is a function of another benchmark's module.
WITHIN = {"loop_kept": ("loop", "keep"), "loop_check": ("loop", "check")}

if __name__ == "__main__":
    # Before numpy loads: thread pools cost more than they give at this size, and blur the times.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    asked = sys.argv[1:] or list(NAMES)
    unknown = [name for name in asked if name not in NAMES + LONG]
    if unknown:
        sys.exit(f"no benchmark {unknown[0]!r}; there are {', '.join(NAMES + LONG)}")
    for name in asked:
        module, function = WITHIN.get(name, (name, "main"))
        getattr(importlib.import_module(f"tests.benchmarks.{module}"), function)()
