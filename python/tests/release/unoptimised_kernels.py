"""Lets Warp compile its kernels without optimisation: in half the time, which is most of the time of these tests.

python python/tests/release/unoptimised_kernels.py EXAMPLE.py

runs an example with the kernels of the tests, so that they are compiled once.
"""

import runpy
import sys

import warp


def unoptimised():
    warp.config.optimization_level = 0


if __name__ == "__main__":
    unoptimised()
    del sys.argv[0]
    runpy.run_path(sys.argv[0], run_name="__main__")
