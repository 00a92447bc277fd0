"""Runs the test programs of the workspace, as many at a time as there are processors, because most of
them keep one busy. `cargo test` runs one after the other, and cargo-nextest runs each test as a process
of its own, which would compile kernels and encode meshes for each test again.

    cargo test --no-run --message-format=json … | test_programs.py FOLDER [PROGRAM[:FILTER,FILTER…] …]

The named programs of `tesdf-gpu` run a second time, with the replacement of CUDA's driver in FOLDER as
their device. What a program prints appears when it ends.
"""

import json
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

# Programs of tesdf-gpu with tests that run on CUDA's replacement alone, by a part of their names: the
# software Vulkan driver compiles their kernels for ten minutes.
ON_CUDA_ALONE = {"inside_rules": "in_all_modes"}
# Their programs take longest, so they begin first, and none is left to run alone at the end.
FIRST = ["tesdf-gpu", "tesdf-sim", "tesdf-bench"]


def programs(messages):
    """The programs that cargo has built: package, name and file."""
    for message in map(json.loads, messages):
        if message["reason"] == "compiler-message":
            print(message["message"]["rendered"], file=sys.stderr)
        if message["reason"] == "compiler-artifact" and message["executable"] and message["profile"]["test"]:
            folder = Path(message["manifest_path"]).parent
            target = message["target"]
            name = target["name"] if target["kind"] == ["test"] else f"unit tests of {target['kind'][0]} {target['name']}"
            yield folder, name, message["executable"]


def jobs(built, cuda, again):
    """All runs: name, command, folder and environment."""
    for folder, name, file in built:
        is_on_software = folder.name == "tesdf-gpu" and not os.environ.get("TESDF_DEVICE")
        skipped = ON_CUDA_ALONE.get(name) if is_on_software else None
        without = ["--skip", skipped] if skipped else []
        yield f"{folder.name}: {name}", [file, "--quiet", *without], folder, {}
    of_gpu = {name: (folder, file) for folder, name, file in built if folder.name == "tesdf-gpu"}
    for program in again:
        name, _, filters = program.partition(":")
        folder, file = of_gpu[name]
        environment = {"LD_LIBRARY_PATH": cuda, "TESDF_DEVICE": "cuda:0"}
        yield f"tesdf-gpu: {name} on CUDA", [file, "--quiet", *filters.split(",")], folder, environment


def order(job):
    return next((k for k, name in enumerate(FIRST) if job[0].startswith(name)), len(FIRST))


def run(job):
    name, command, folder, environment = job
    start = time.monotonic()
    ran = subprocess.run(
        command,
        cwd=folder,
        env=os.environ | environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
    )
    return name, ran.returncode, ran.stdout, time.monotonic() - start


def main():
    cuda, *again = sys.argv[1:]
    built = list(programs(sys.stdin))
    if not built:
        print("error: cargo named no test program", file=sys.stderr)
        return 1
    queue = sorted(jobs(built, cuda, again), key=order)
    failed = []
    times = os.environ.get("STEP_TIMES")
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for done in as_completed([pool.submit(run, job) for job in queue]):
            name, status, printed, seconds = done.result()
            print(f"+ {name} ({seconds:.0f} s)\n{printed.strip()}\n", flush=True)
            if times:
                with open(times, "a") as file:
                    print(f"{seconds:6.0f} s  {name}", file=file)
            if status:
                failed.append(f"{name}: exit status {status}")
    print(f"{len(queue)} test programs, {len(failed)} failed", *failed, sep="\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
