"""Layers that are made, written and dropped leave nothing behind in USD."""

import ctypes
import gc
from pathlib import Path

import pytest
from pxr import Sdf

from usdface.io.usd.spec_handles import hold_specs
from usdface.io.usd.stage import save_layer

SPECS, ROUNDS = 40, 200
KEPT = 32  # bytes of a spec, without


class _Heap(ctypes.Structure):
    _fields_ = [(name, ctypes.c_size_t) for name in "abcdefghij"]


def in_use() -> int:
    """Bytes that are allocated natively."""
    library = ctypes.CDLL(None)
    if not hasattr(library, "mallinfo2"):
        pytest.skip("the C library does not tell what is allocated")
    library.mallinfo2.restype = _Heap
    gc.collect()
    found = library.mallinfo2()
    return int(found.h + found.e)  # in small and in large blocks


def authored() -> Sdf.Layer:
    layer = Sdf.Layer.CreateAnonymous(".usda")
    prim = Sdf.CreatePrimInLayer(layer, "/A/B")
    for number in range(SPECS):
        Sdf.AttributeSpec(prim, f"a{number}", Sdf.ValueTypeNames.Float)
    return layer


def growth(rounds: int, hold: bool) -> float:
    """Bytes that each spec leaves behind."""

    def once() -> None:
        layer = authored()
        if hold:
            hold_specs(layer)

    for _ in range(50):
        once()
    before = in_use()
    for _ in range(rounds):
        once()
    return (in_use() - before) / (rounds * SPECS)


def test_usd_keeps_nothing_of_specs_whose_handles_outlive_the_layer() -> None:
    assert growth(ROUNDS, hold=True) < KEPT / 4


def test_a_written_layer_is_held_until_it_is_gone(tmp_path: Path) -> None:
    from usdface.io.usd import spec_handles

    layer = authored()
    save_layer(layer, tmp_path / "a.usda")
    mine = [specs for specs in spec_handles._held if specs[0].layer == layer]
    assert len(mine) == 1 and len(mine[0]) == SPECS + 3
    del layer, mine
    other = authored()
    hold_specs(other)
    assert not any(specs[0].expired for specs in spec_handles._held)
