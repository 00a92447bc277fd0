"""Exceptions with the library's messages. Errors of the operating system are `OSError`s."""

from __future__ import annotations

from .reports import CheckReport


class MeshError(ValueError):
    """A file or arrays do not contain a valid mesh."""


class NotSolidError(MeshError):
    """A mesh has no well-defined inside. `report` has all defects, as `check` reports them."""

    report: CheckReport

    def __init__(self, message: str, report: CheckReport) -> None:
        super().__init__(message)
        self.report = report

    def __reduce__(self) -> tuple[type[NotSolidError], tuple[str, CheckReport]]:
        return type(self), (str(self), self.report)


class EncodeError(ValueError):
    """A solid cannot be encoded with these options."""


class DeformError(ValueError):
    """Vertices cannot be moved. The asset is unchanged."""


class AssetError(ValueError):
    """A file or bytes are not an asset of this version, or are damaged."""


class CollideError(ValueError):
    """A scene, a detection or a measurement of two bodies is refused. The scene is unchanged."""


class DeviceError(ValueError):
    """A device does not exist or has failed, or the package was built without devices."""


class SceneError(ValueError):
    """A scene file cannot be simulated. The message names its line."""


class SimulationError(ValueError):
    """A step of a simulation failed, or a scene exceeds a limit."""
