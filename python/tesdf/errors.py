"""Why something could not be done, in the library's own words. What the system refuses is an `OSError`."""

from __future__ import annotations

from .reports import CheckReport


class MeshError(ValueError):
    """A file or arrays do not give a mesh."""


class NotSolidError(MeshError):
    """A mesh has no well-defined inside; `report` has all defects, as `check` gives them."""

    report: CheckReport

    def __init__(self, message: str, report: CheckReport) -> None:
        super().__init__(message)
        self.report = report

    def __reduce__(self) -> tuple[type[NotSolidError], tuple[str, CheckReport]]:
        return type(self), (str(self), self.report)


class EncodeError(ValueError):
    """A solid cannot be encoded as asked."""


class DeformError(ValueError):
    """Vertices cannot be moved; nothing was."""


class AssetError(ValueError):
    """A file or bytes are not an asset of this version, or were damaged."""
