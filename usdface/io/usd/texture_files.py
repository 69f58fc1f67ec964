"""Files of textures beside a USD file that is written."""

import hashlib
import re
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.asset_folder import read_file
from usdface.io.atomic import write_bytes
from usdface.io.inputs import first_free
from usdface.io.udim import udim_tiles
from usdface.io.usd.assets import LARGEST_ASSET
from usdface.materials import Texture

__all__ = ["TextureFiles"]


class TextureFiles:
    """Where the textures of one stage lie, as asset paths; equal bytes are one file."""

    def __init__(
        self, target: Path, findings: list[Finding], taken: Callable[[Path], bool]
    ) -> None:
        self._target = target
        self._findings = findings
        self._taken = taken
        self._written: dict[str, str] = {}

    def asset(self, texture: Texture, name: str) -> str:
        """Return the asset path, "" where the file cannot be read."""
        if "<UDIM>" in texture.path:
            return self._tiles(texture, name)
        folder = self._target.parent.resolve()
        data, suffix = texture.data, texture.suffix
        if data is None:
            path = Path(texture.path).resolve()
            if path.is_file() and path.is_relative_to(folder):
                return f"./{path.relative_to(folder).as_posix()}"
            try:
                data, suffix = read_file(path, LARGEST_ASSET), path.suffix
            except InputError as error:
                message = "{error}; the texture is left out"
                self._findings.append(finding("TEXTURE_MISSING", name, message, error))
                return ""
        key = hashlib.sha256(data).hexdigest()
        if key not in self._written:
            kind = "." + re.sub("[^a-z0-9]", "", suffix.lower())
            ending = kind if len(kind) > 1 else ""
            names = (f"{stem}{ending}" for stem in self._stems(name))
            place, there = first_free(folder, names, data, self._taken)
            if not there:
                write_bytes(folder / place, data)
            self._written[key] = f"./{place}"
        return self._written[key]

    def _tiles(self, texture: Texture, name: str) -> str:
        """Return the asset path of a UDIM; its tiles are copied as `asset` copies files."""
        folder, path = self._target.parent.resolve(), Path(texture.path).resolve()
        tiles = udim_tiles(texture)
        if not tiles:
            message = "{file} has no tiles; the texture is left out"
            self._findings.append(finding("TEXTURE_MISSING", name, message, texture.path))
            return ""
        if path.is_relative_to(folder):
            return f"./{path.relative_to(folder).as_posix()}"
        for stem in self._stems(name):
            place = f"{stem}.<UDIM>{path.suffix}"
            targets = {n: folder / place.replace("<UDIM>", str(n)) for n in tiles}
            if not any(map(self._taken, targets.values())):
                break
        for number, tile in tiles.items():
            try:
                data = read_file(Path(tile.path), LARGEST_ASSET)
            except InputError as error:
                message = "{error}; the tile is left out"
                self._findings.append(finding("TEXTURE_MISSING", name, message, error))
                continue
            write_bytes(targets[number], data)
        return f"./{place}"

    def _stems(self, name: str) -> Iterator[str]:
        """Yield endless places for a texture, without ending: its name, then with a number."""
        first = f"{self._target.stem}_textures/{name}"
        return (f"{first}_{n}" if n else first for n in count())
