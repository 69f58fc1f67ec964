"""PNG files whose bytes only depend on the image."""

import struct
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

__all__ = ["write_png"]


def write_png(image: NDArray[np.uint8], path: Path) -> None:
    """Write an image (H, W, 3) as PNG; the same image gives the same bytes."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        check = zlib.crc32(kind + data)
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", check)

    height, width = image.shape[:2]
    rows = np.pad(image.reshape(height, -1), ((0, 0), (1, 0)))  # filter type 0 before each row
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    packed = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 9))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + packed + chunk(b"IEND", b""))
