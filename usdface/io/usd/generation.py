"""The generation of a result, in its layers (`usdface.io.generation`)."""

from pathlib import Path

from pxr import Sdf

from usdface.io.usd.conversion_metadata import read_layer_metadata, write_layer_metadata
from usdface.io.usd.stage import Stage

__all__ = ["generation_of_stage", "layer_generation", "mark_generation", "stage_generations"]

_ID = "generation"


def mark_generation(layer: Sdf.Layer, generation: str) -> None:
    """Author the generation of a layer that is about to be written."""
    write_layer_metadata(layer, _ID, generation)


def stage_generations(stage: Stage) -> dict[Path, str]:
    """Return the generation of each layer of a stage that has one."""
    found = {Path(layer.realPath): layer_generation(layer) for layer in stage.GetUsedLayers()}
    return {path: generation for path, generation in found.items() if generation}


def generation_of_stage(stage: Stage, path: Path) -> dict[str, str]:
    """Return the metadata for a glTF of a stage at `path`; {} if that is no result, or several."""
    found = set(stage_generations(stage).values())
    return {_ID: found.pop(), "result": path.name} if len(found) == 1 else {}


def layer_generation(layer: Sdf.Layer) -> str:
    """Return the generation of a layer; "" where it has none."""
    return str(read_layer_metadata(layer).get(_ID, ""))
