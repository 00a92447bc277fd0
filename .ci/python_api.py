#!/usr/bin/env python3
"""Writes the interface of the installed Python package as pages: `.ci/python_api.py FOLDER`, called by `.ci/site.sh`.

Modules for other programs are documented without them: what they import from there are stand-ins."""

import pathlib
import sys
import warnings
from unittest import mock

import pdoc


class StandIn(mock.MagicMock):
    """A module, function or class of another program. Decorators leave what they decorate as it is."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        # Those of a function, for signatures.
        self.__dict__.update(__qualname__="...", __name__="...", __module__="other")

    def __repr__(self):
        return self._extract_mock_name().removesuffix("()") if self._mock_name or self._mock_new_name else "..."

    def __call__(self, *arguments, **options):
        return arguments[0] if len(arguments) == 1 and callable(arguments[0]) else StandIn()

    def __mro_entries__(self, bases):
        return ()


others = ["mujoco", "mujoco_warp", "newton", "newton.geometry", "newton.solvers", "torch", "torch.autograd", "warp"]
for name in others:
    sys.modules[name] = StandIn(name=name)
# Annotations that only type checkers can resolve are shown as they are written.
warnings.simplefilter("ignore")
pdoc.render.configure(docformat="google", include_undocumented=False, show_source=False)
modules = ["tesdf", "tesdf.mujoco", "tesdf.mujoco_warp", "tesdf.newton", "tesdf.torch", "tesdf.usd"]
pdoc.pdoc(*modules, output_directory=pathlib.Path(sys.argv[1]))
