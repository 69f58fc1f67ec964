"""UDIM textures: the tiles of an image, and rigs whose materials show one tile each.

Tile 1001 + u + 10 v holds the unit square of texture coordinates at (u, v), v up.
"""

import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.findings import Finding, finding
from usdface.io.unique_name import unique_name
from usdface.materials import Material, Texture
from usdface.rigs import MaterialSubset, Mesh, Rig

__all__ = ["is_udim", "texture_files", "udim_tiles", "untiled"]

_MARK = "<UDIM>"
_FIRST, _ROW = 1001, 10  # UDIM: tile 1001 + u + 10 v


def is_udim(path: Path) -> bool:
    """Return whether a path stands for the tiles of a UDIM texture."""
    return _MARK in str(path)


def udim_tiles(texture: Texture) -> dict[int, Texture]:
    """Return the files of a texture whose path has ``<UDIM>`` in its name, by tile number."""
    path = Path(texture.path)
    before, _, after = path.name.partition(_MARK)
    pattern = re.compile(f"{re.escape(before)}([1-9][0-9]{{3}}){re.escape(after)}")
    try:
        names = sorted(file.name for file in path.parent.iterdir())
    except OSError:
        return {}
    found = ((match, name) for name in names if (match := pattern.fullmatch(name)))
    return {int(match[1]): replace(texture, path=str(path.with_name(n))) for match, n in found}


def texture_files(materials: Iterable[Material]) -> list[Path]:
    """Return the image files that materials show, of UDIM textures all tiles."""
    textures = [t for material in materials for t in _of(material) if t.path]
    tiles = [udim_tiles(t).values() if _MARK in t.path else [t] for t in textures]
    return [Path(tile.path) for found in tiles for tile in found]


def untiled(rig: Rig) -> tuple[Rig, list[Finding]]:
    """Give each tile of UDIM textures a material of its own, and the faces that lie on it.

    A face belongs to the tile that the middle of its texture coordinates is on; coordinates stay,
    since a texture that repeats looks the same on every tile. A tile without a file leaves its
    faces without that texture (TEXTURE_MISSING).

    Returns
    -------
    Rig
        The same where there is no UDIM texture.
    list of Finding
    """
    tiled = {m.name: m for m in rig.materials if any(_MARK in t.path for t in _of(m))}
    if not tiled:
        return rig, []
    found = [finding("TEXTURE_TILED", f"material {name}") for name in tiled]
    made: dict[tuple[str, int], str] = {}
    names = {material.name for material in rig.materials}
    meshes = tuple(_split(mesh, tiled, made, names) for mesh in rig.meshes)
    files = {t.path: udim_tiles(t) for m in tiled.values() for t in _of(m) if _MARK in t.path}
    materials = [m for m in rig.materials if m.name not in tiled]
    for (name, tile), own in made.items():
        chosen, missing = _one_tile(tiled[name], tile, files)
        materials.append(replace(chosen, name=own))
        for path in missing:
            message = "{file} has no tile {tile}; the texture is left out there"
            found.append(finding("TEXTURE_MISSING", f"material {name}", message, str(path), tile))
    return replace(rig, meshes=meshes, materials=tuple(materials)), found


def _of(material: Material) -> Iterable[Texture]:
    return material.textures.values()


def _split(
    mesh: Mesh, tiled: dict[str, Material], made: dict[tuple[str, int], str], names: set[str]
) -> Mesh:
    whole = np.arange(len(mesh.face_counts))
    taken = [s.faces for s in mesh.subsets]
    rest = np.setdiff1d(whole, np.concatenate(taken)) if taken else whole
    subsets: list[MaterialSubset] = []
    for name, faces in [*((s.material, s.faces) for s in mesh.subsets), (mesh.material, rest)]:
        if name not in tiled:
            subsets += [MaterialSubset(name, faces)] if name or faces is not rest else []
            continue
        uv = next(t.placed.uv for t in _of(tiled[name]) if _MARK in t.path)
        uvs = mesh.uv_sets.get(uv, mesh.uvs)
        tiles = _tiles(mesh, faces, uvs)
        for tile in np.unique(tiles).tolist():
            if (name, tile) not in made:
                made[name, tile] = unique_name(f"{name}_{tile}", names)
                names.add(made[name, tile])
            subsets.append(MaterialSubset(made[name, tile], faces[tiles == tile]))
    if all(s.material == mesh.material for s in subsets) and mesh.material not in tiled:
        return mesh
    kept = "" if mesh.material in tiled else mesh.material
    shown = [s for s in subsets if s.material != kept and len(s.faces)]
    return replace(mesh, material=kept, subsets=tuple(shown))


def _tiles(mesh: Mesh, faces: IntArray, uvs: FloatArray | None) -> IntArray:
    if uvs is None:
        return np.full(len(faces), _FIRST)
    starts = np.cumsum(mesh.face_counts) - mesh.face_counts
    total = np.zeros((len(mesh.face_counts) + 1, 2))
    face = np.repeat(np.arange(len(starts)), mesh.face_counts)
    np.add.at(total, face, uvs)
    middle = total[:-1] / np.maximum(mesh.face_counts, 1)[:, None]
    place = np.floor(middle[faces]).astype(np.int64).clip(0, (_ROW - 1, 899))
    return np.asarray(_FIRST + place[:, 0] + _ROW * place[:, 1], np.int64)


def _one_tile(
    material: Material, tile: int, files: dict[str, dict[int, Texture]]
) -> tuple[Material, list[str]]:
    chosen: dict[str, Texture | None] = {}
    missing: list[str] = []
    for slot, texture in material.textures.items():
        if _MARK in texture.path:
            file = files[texture.path].get(tile)
            chosen[slot] = file and replace(texture, path=file.path)
            missing += [] if file or texture.path in missing else [texture.path]
    return replace(material, **chosen), missing  # type: ignore[arg-type]
