"""Lets Warp compile its kernels in half the time. They run as fast in tests, which have few contacts to a step.

python python/tests/unoptimised_kernels.py EXAMPLE.py

runs an example with the kernels of the tests, so that they are compiled once.
"""

import runpy
import sys


def unoptimised(warp):
    warp.config.optimization_level = 0


if __name__ == "__main__":
    try:
        import warp
    except ImportError:  # an example without Warp
        pass
    else:
        unoptimised(warp)
    runpy.run_path(sys.argv[1], run_name="__main__")
