#!/usr/bin/env python3
"""Writes the pages of the site for mdBook: `.ci/site.py FOLDER`, called by `.ci/site.sh`.

The pages are the documents of the repository that `docs/SUMMARY.md` lists. Those of `docs` lie at the top. A link to
another page, or to a file in `docs`, stays one. A link to the source of a library leads to its interface, and any
other to the file in the repository on the web, at the commit."""

import os
import pathlib
import re
import shutil
import subprocess
import sys

root = pathlib.Path(__file__).resolve().parent.parent
out = pathlib.Path(sys.argv[1])
web = re.search(r'^repository = "(.*)"$', (root / "Cargo.toml").read_text(), re.M)[1]
commit = subprocess.run(["git", "rev-parse", "HEAD"], cwd=root, check=True, stdout=subprocess.PIPE, text=True).stdout.strip()

LINK = re.compile(r"(\]\()([^)\s#:]+)?(#[^)\s]*)?(\))")


def page(path):
    """The place of a document in the site: `docs/x.md` is `x.md`, and `a/README.md` is `a.md`."""
    if path.startswith("docs/"):
        path = path[len("docs/") :]
        return re.sub(r"(^|/)README\.md$", r"\1index.md", path)
    if path == "README.md":
        return "install.md"
    return re.sub(r"/README\.md$", ".md", path).replace("lab/results", "results").lower()


summary = (root / "docs/SUMMARY.md").read_text()
documents = [os.path.normpath(f"docs/{found[2]}") for found in LINK.finditer(summary)]
pages = {path: page(path) for path in documents}
assert len(set(pages.values())) == len(documents) > 20, pages


def of_site(path):
    """Where a link to a file of the repository leads, and whether the site has it."""
    if path in pages:
        return pages[path], True
    if path.startswith("docs/"):
        return path[len("docs/") :], True
    if crate := re.fullmatch(r"crates/([a-z-]+)/src/lib\.rs", path):
        return f"api/rust/{crate[1].replace('-', '_')}/index.html", True
    if module := re.fullmatch(r"python/tesdf/([a-z]\w*)\.py", path):
        return f"api/python/tesdf/{module[1]}.html", True
    if path == "python/tesdf/__init__.py":
        return "api/python/tesdf.html", True
    kind = "tree" if (root / path).is_dir() else "blob"
    return f"{web}/{kind}/{commit}/{path}", False


def rewritten(text, path):
    """The text of a document with the links of the site."""

    def link(found):
        target, anchor = found[2], found[3] or ""
        file = os.path.normpath(os.path.join(os.path.dirname(path), target)) if target else path
        if not target or not (root / file).exists():
            return found[0]
        place, has_it = of_site(file)
        if has_it:
            place = os.path.relpath(place, os.path.dirname(page(path)) or ".")
        return f"{found[1]}{place}{anchor}{found[4]}"

    return LINK.sub(link, text)


shutil.rmtree(out, ignore_errors=True)
shutil.copytree(root / "docs", out / "pages", ignore=shutil.ignore_patterns("*.md", "book.toml"))
shutil.copy(root / "docs/book.toml", out)
for path in documents:
    to = out / "pages" / page(path)
    to.parent.mkdir(parents=True, exist_ok=True)
    to.write_text(rewritten((root / path).read_text(), path))
lines = LINK.sub(lambda found: f"]({pages[os.path.normpath('docs/' + found[2])]})", summary)
(out / "pages/SUMMARY.md").write_text(lines)
if (root / "docs/demo/index.html").exists():
    with (out / "pages/index.md").open("a") as first:
        first.write("\n[Try it in the browser](demo/index.html): contacts of meshes, computed on this page.\n")
