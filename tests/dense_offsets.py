"""Vertex offsets of whole arrays."""

import numpy as np

from usdface.certificate.vertex_offsets import VertexOffsets, moved_part


def dense_offsets(values: np.ndarray) -> VertexOffsets:
    """Return the offsets of an array (B, N, 3)."""
    return VertexOffsets.of(values.shape[1], map(moved_part, values))
