"""Memory that tesdf and NVIDIA Warp share on a CUDA device."""

from __future__ import annotations

from typing import Any

import warp as wp

from ._native import DeviceArray

# The number of the legacy default stream in `__cuda_array_interface__`.
_LEGACY_DEFAULT_STREAM = 1


def cuda_number(device: Any) -> int | None:
    """The number in CUDA of a device of Warp; None for the processor."""
    return int(device.ordinal) if device.is_cuda else None


class Memory:
    """An array of Warp, float32 [N, C], for tesdf. All work with it must be complete."""

    def __init__(self, array: Any) -> None:
        self._array = array
        self.__cuda_array_interface__ = {
            "shape": tuple(array.shape),
            "typestr": "<f4",
            "data": (array.ptr, False),
            "strides": None,
            "version": 3,
            "stream": _LEGACY_DEFAULT_STREAM,
        }

    def numpy(self) -> Any:
        """A copy on the processor."""
        return self._array.numpy()


def in_place(array: DeviceArray, dtype: Any, device: Any) -> Any:
    """An array of tesdf as one of Warp, [N] of this type. It does not keep the memory."""
    pointer = array.__cuda_array_interface__["data"][0]
    return wp.array(ptr=pointer, dtype=dtype, shape=(len(array),), device=device)
