"""Writes the docstrings of the compiled module into its stubs, where editors look for them:

python python/tests/stub_docstrings.py
"""

import ast
import inspect
from pathlib import Path
from typing import Any

import tesdf._native

STUBS = Path(__file__).resolve().parents[1] / "tesdf" / "_native.pyi"


def with_docstrings(text: str) -> str:
    """The stubs with the docstrings of the module, in place of those that they have."""
    lines = text.splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line.encode()))
    place = lambda line, column: starts[line - 1] + column  # noqa: E731
    data, changes = text.encode(), []
    for node, found in documented(ast.parse(text)):
        doc = inspect.getdoc(found)
        if not doc or '"""' in doc or "\\" in doc:
            continue
        indent = " " * (node.col_offset + 4)
        rest = f"{doc} " if doc.endswith('"') else doc
        quoted = indent + '"""' + "\n".join(line and indent + line for line in rest.splitlines()).lstrip() + '"""'
        changes.append((place(node.body[0].lineno, node.body[0].col_offset), place(node.body[-1].end_lineno, node.body[-1].end_col_offset), quoted))
    for start, end, quoted in sorted(changes, reverse=True):
        data = data[:start].rstrip() + b"\n" + quoted.encode() + data[end:]
    return data.decode()


def documented(tree: ast.Module) -> Any:
    """Functions and methods of the stubs, and what the module has of their names. Of overloads, the first."""
    functions = (ast.FunctionDef,)
    for node in tree.body:
        if isinstance(node, functions):
            yield node, getattr(tesdf._native, node.name)
        # Without the GPU, the module has another DeviceArray.
        if isinstance(node, ast.ClassDef) and node.name != "DeviceArray" and not node.name.startswith("_"):
            seen = set()
            for method in node.body:
                if isinstance(method, functions) and not method.name.startswith("__") and method.name not in seen:
                    seen.add(method.name)
                    yield method, getattr(getattr(tesdf._native, node.name), method.name)


if __name__ == "__main__":
    STUBS.write_text(with_docstrings(STUBS.read_text()))
