"""What notebooks show of assets and contacts."""

from __future__ import annotations

import base64
import html
import struct
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

# Rows of a table that are shown, and points along the longer side of a picture.
_ROWS, _POINTS = 10, 240


def of_rows(table: Any) -> str:
    """The first rows of a table."""
    columns = table.to_dict()
    head = "".join(f"<th>{html.escape(name)}</th>" for name in columns)
    cells = zip(*(column[:_ROWS].tolist() for column in columns.values()))
    body = "".join("<tr>" + "".join(f"<td>{_number(cell)}</td>" for cell in row) + "</tr>" for row in cells)
    more = f"<p>… {len(table) - _ROWS} more rows</p>" if len(table) > _ROWS else ""
    return f"<p>{html.escape(repr(table))}</p><table><tr>{head}</tr>{body}</table>{more}"


def _number(value: Any) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def of_asset(asset: Any) -> str:
    """Figures of an asset, and its signed distance in the plane through the centre of its bounds, at
    right angles to its shortest side."""
    low, high = asset.bounds
    normal = int(np.argmin(high - low))
    across, up = (axis for axis in range(3) if axis != normal)
    margin = 0.05 * np.linalg.norm(high - low)
    size = (high - low) + 2 * margin
    step = max(size[across], size[up]) / _POINTS
    points = np.empty((max(int(size[up] / step), 1), max(int(size[across] / step), 1), 3))
    points[..., normal] = (low + high)[normal] / 2
    points[..., across] = low[across] - margin + step * (np.arange(points.shape[1]) + 0.5)
    points[..., up] = (high[up] + margin - step * (np.arange(points.shape[0]) + 0.5))[:, None]
    distance = asset.signed_distance(points.reshape(-1, 3), "f32").reshape(points.shape[:2])
    picture = base64.b64encode(_png(_colours(distance, step))).decode()
    unit = f" {html.escape(asset.unit)}" if asset.unit else ""
    extent = " × ".join(f"{length:.4g}" for length in high - low)
    plane = f"{'xyz'[normal]} = {(low + high)[normal] / 2:.4g}"
    return (
        f"<p>{html.escape(repr(asset))}<br>{extent}{unit}</p>"
        f'<img alt="signed distance at {plane}" src="data:image/png;base64,{picture}">'
        f"<p>signed distance at {plane}: inside orange, outside blue</p>"
    )


def _colours(distance: npt.NDArray[np.float64], step: float) -> npt.NDArray[np.uint8]:
    """Orange inside and blue outside, darker near the surface, which is black; with lines of equal
    distance."""
    depth = np.abs(distance)
    share = depth / max(depth.max(), step)
    inside, outside = np.array([250.0, 170, 80]), np.array([110.0, 160, 230])
    colour = np.where((distance < 0)[..., None], inside, outside)
    colour = colour * (0.65 + 0.35 * share)[..., None]
    lines = np.floor(share * 10)
    edge = (lines[:, 1:] != lines[:, :-1])[:-1] | (lines[1:] != lines[:-1])[:, :-1]
    colour[:-1, :-1][edge] *= 0.85
    colour[depth < 0.75 * step] = 0
    return colour.astype(np.uint8)


def _png(pixels: npt.NDArray[np.uint8]) -> bytes:
    """The file of a picture [height, width, 3]."""
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), np.uint8)  # each row begins with the number of its filter
    rows[:, 1:] = pixels.reshape(height, -1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes())) + chunk(b"IEND", b"")
