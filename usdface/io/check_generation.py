"""Check that the files of a result are of one generation: `usdface check`."""

from collections.abc import Sequence
from pathlib import Path

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.generation import gltf_generation
from usdface.io.gltf.external_files import may_be_gltf
from usdface.io.layer_paths import layer_paths

__all__ = ["check_generations"]


def check_generations(files: Sequence[Path]) -> list[Finding]:
    """Return GENERATION_MIXED for layers of a result, and glTF of it, that are of several runs.

    A glTF is compared with the root layer that it names, among the files or beside it. Files that
    cannot be read are not compared.
    """
    found = []
    for path in files:
        try:
            found += _gltf(path, files) if may_be_gltf(path) else _layers(path)
        except InputError:
            continue
    return found


def _layers(path: Path) -> list[Finding]:
    results: dict[Path, dict[Path, str]] = {}
    for layer, generation in _generations(path).items():
        inner = layer.parent.suffix == ".usdface"
        folder = layer.parent if inner else layer_paths(layer, layer).folder
        results.setdefault(folder, {})[layer] = generation
    message = "layers are of several runs: {names}"
    return [
        finding("GENERATION_MIXED", str(path), message, sorted(p.name for p in layers))
        for layers in results.values()
        if len(set(layers.values())) > 1
    ]


def _gltf(path: Path, files: Sequence[Path]) -> list[Finding]:
    made = gltf_generation(path)
    if made is None or Path(made["result"]).name != made["result"]:
        return []
    named = [file for file in files if file.name == made["result"]]
    root = next(iter(named), path.parent / made["result"])
    generations = _generations(root) if root.is_file() else {}
    if not generations or made["generation"] in generations.values():
        return []
    message = "it is of another run than {layer}"
    return [finding("GENERATION_MIXED", str(path), message, root.name)]


def _generations(path: Path) -> dict[Path, str]:
    from usdface.io.usd.generation import stage_generations  # only where there is USD
    from usdface.io.usd.stage import open_stage

    return stage_generations(open_stage(path))
