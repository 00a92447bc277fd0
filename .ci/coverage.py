#!/usr/bin/env python3
"""Prints the coverage per crate and folder, from what `llvm-cov export` says of each program of tests:

    .ci/coverage.py PROGRAM.json... [FOLDER...]

Code of tests does not count. A generic function counts once: what any of its instances does counts as done.
For each FOLDER (`tesdf/geometry`) it lists the ways of branches that are never taken."""

import collections
import json
import pathlib
import re
import sys

exported = [argument for argument in sys.argv[1:] if argument.endswith(".json")]
listed = [argument for argument in sys.argv[1:] if argument not in exported]
crates = pathlib.Path(__file__).resolve().parent.parent / "crates"
parts = {}


class Part:
    """What counts in a folder: whether each line and region runs, and whether each branch goes both ways."""

    def __init__(self):
        self.lines, self.regions = collections.Counter(), collections.Counter()
        self.branches = collections.defaultdict(lambda: [0, 0])


def test_line(path):
    """The line from which a file is tests."""
    below = path.relative_to(crates).with_suffix("").parts[2:]
    folders = [folder for folder in path.parents if folder.is_relative_to(crates)]
    around = [file for folder in folders for file in folder.glob("*.rs")]
    only = rf"#\[cfg\(test\)\]\n(?:pub\(crate\) )?mod (?:{'|'.join(below)});"
    if any(re.search(only, file.read_text()) for file in around):
        return 0
    before, *tests = path.read_text().split("#[cfg(test)]\nmod tests")
    return before.count("\n") + 1 if tests else float("inf")


def part(name, known={}):
    """The folder of a file, and the line from which the file does not count."""
    if name not in known:
        path = pathlib.Path(name)
        known[name] = (None, 0)
        if path.is_relative_to(crates) and path.relative_to(crates).parts[1] == "src":
            crate, _, *below = path.relative_to(crates).with_suffix("").parts
            known[name] = (parts.setdefault(f"{crate}/{below[0]}", Part()), test_line(path))
    return known[name]


def add(found):
    """Adds what one program does."""
    for function in found["functions"]:
        names = function["filenames"]
        for *place, count, file, _, kind in function["regions"]:
            folder, end = part(names[file])
            if kind == 0 and place[0] < end:
                folder.regions[names[file], *place] += count
        for *place, yes, no, file, _, _ in function["branches"]:
            folder, end = part(names[file])
            if place[0] < end:
                ways = folder.branches[names[file], *place]
                ways[0], ways[1] = ways[0] + yes, ways[1] + no
    for file in found["files"]:
        # A line runs as often as the region that covers its beginning, or one that starts on it.
        folder, end = part(file["filename"])
        for (line, _, count, counts, starts, gap), after in zip(file["segments"], file["segments"][1:]):
            if counts and line < end and starts and not gap:
                folder.lines[file["filename"], line] += count
            if counts:
                for covered in range(line + 1, min(after[0] + 1, end)):
                    folder.lines[file["filename"], covered] += count


def row(name, counted):
    shares = []
    for done in (lambda p: p.lines.values(), lambda p: p.regions.values(), lambda p: sum(p.branches.values(), [])):
        all_of_them = [count > 0 for p in counted for count in done(p)]
        share = f"{100 * sum(all_of_them) / len(all_of_them):.1f} %" if all_of_them else "none"
        shares.append(f"{share} of {len(all_of_them)}")
    print(f"| {name:24} | {' | '.join(f'{share:16}' for share in shares)} |")


for file in exported:
    add(json.load(open(file))["data"][0])
print(f"| {'':24} | {'lines':16} | {'regions':16} | {'branches':16} |\n|{'-' * 26}{('|' + '-' * 18) * 3}|")
for crate in dict.fromkeys(name.split("/")[0] for name in sorted(parts)):
    inside = sorted(name for name in parts if name.startswith(f"{crate}/"))
    row(crate, [parts[name] for name in inside])
    for name in inside:
        row(name, [parts[name]])
for name in filter(parts.get, listed):
    for (file, line, column, *_), ways in sorted(parts[name].branches.items()):
        for way, count in zip(("true", "false"), ways):
            if not count:
                print(f"{pathlib.Path(file).relative_to(crates.parent)}:{line}:{column}: never {way}")
