#!/usr/bin/env python3
"""Prints the licences of all crates that a package of this workspace is linked from, with their texts:

    .ci/licences.py PACKAGE TARGET FEATURES >THIRD-PARTY-LICENCES.txt

A text that several crates have is printed once."""

import json
import pathlib
import subprocess
import sys

package, target, features = sys.argv[1:]
command = ["cargo", "metadata", "--quiet", "--locked", "--format-version", "1", "--filter-platform", target]
command += ["--features", ",".join(f"{package}/{feature}" for feature in features.split(",") if feature)]
found = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
crates = {crate["id"]: crate for crate in found["packages"]}
nodes = {node["id"]: node for node in found["resolve"]["nodes"]}

# Crates that the program is linked from: not those of tests, or of build scripts.
linked, waiting = set(), [crate["id"] for crate in found["packages"] if crate["name"] == package]
while waiting:
    crate = waiting.pop()
    if crate not in linked:
        linked.add(crate)
        normal = (to for to in nodes[crate]["deps"] if any(kind["kind"] is None for kind in to["dep_kinds"]))
        waiting += [to["pkg"] for to in normal]

texts, without = {}, []
others = sorted((c for c in map(crates.get, linked) if c["source"]), key=lambda c: (c["name"], c["version"]))
for crate in others:
    name = f"{crate['name']} {crate['version']}"
    folder = pathlib.Path(crate["manifest_path"]).parent
    files = [f for f in sorted(folder.iterdir()) if f.name.lower().startswith(("licen", "copying", "notice", "unlicense"))]
    for file in filter(pathlib.Path.is_file, files):
        texts.setdefault(file.read_text(errors="replace").replace("\r\n", "\n").strip(), []).append(name)
    print(f"{name}: {crate['license'] or 'see its text'}" + ("" if files else "; its package has no text of it"))
assert others and texts, "no crates were found"
for text, names in texts.items():
    print("\n" + "-" * 100 + "\n" + ", ".join(dict.fromkeys(names)) + "\n\n" + text)
