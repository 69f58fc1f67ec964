"""Layers and stages that are opened, made, written and closed leave nothing behind in USD."""

import ctypes
import gc
from collections.abc import Callable
from pathlib import Path

import pytest
from pxr import Sdf, Usd

from usdface.io.usd import held_layers
from usdface.io.usd.held_layers import hold_layers, hold_specs
from usdface.io.usd.save_layers import save_layer
from usdface.io.usd.stage import open_stage

SPECS, ROUNDS, SERIES = 40, 60, 3
KEPT = 32  # bytes of a spec, without
KEPT_OF_STAGE = 1000  # of a stage of two layers


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


def growth(once: Callable[[], object]) -> float:
    """Bytes that each call leaves behind, in the best of some series: tables grow now and then."""
    least = float("inf")
    for _ in range(SERIES):
        before = in_use()
        for _ in range(ROUNDS):
            once()
        least = min(least, (in_use() - before) / ROUNDS)
    return least


def two_layers(folder: Path) -> Path:
    save_layer(authored(), folder / "below.usda")
    top = authored()
    top.subLayerPaths = ["./below.usda"]
    save_layer(top, folder / "top.usda")
    return folder / "top.usda"


@pytest.mark.slow
def test_usd_keeps_nothing_of_specs_whose_handles_outlive_the_layer() -> None:
    assert growth(lambda: hold_specs(authored())) < SPECS * KEPT / 4


@pytest.mark.slow
def test_usd_keeps_nothing_of_layers_that_python_has_owned(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("USDFACE_TRUSTED", "1")
    path = two_layers(tmp_path)

    def used() -> None:
        stage = open_stage(path)
        assert len(stage.GetUsedLayers()) == 3 and stage.GetSessionLayer()

    assert growth(used) < KEPT_OF_STAGE / 4


def test_a_written_layer_is_held_until_it_is_closed(tmp_path: Path) -> None:
    layer = authored()
    save_layer(layer, tmp_path / "a.usda")
    assert len(held_layers._held[layer.identifier]) == SPECS + 3
    del layer
    hold_specs(authored())
    hold_specs(authored())
    roots = [specs[Sdf.Path.absoluteRootPath] for specs in held_layers._held.values()]
    assert sum(root.expired for root in roots) <= 1


def test_an_open_stage_is_held_once(tmp_path: Path) -> None:
    stage = Usd.Stage.Open(str(two_layers(tmp_path)))
    hold_layers(stage)
    held = len(held_layers._held)
    hold_layers(stage)
    hold_specs(stage.GetRootLayer())
    assert len(held_layers._held) == held
