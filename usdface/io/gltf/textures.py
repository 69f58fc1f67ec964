"""Textures of glTF, read and written: images, samplers, texture coordinates, transforms.

Source: glTF 2.0 specification, sections 3.8.2 to 3.8.4; KHR_texture_transform, whose rotation is
that of the implementations (KhronosGroup/glTF#1563): counter-clockwise where v points up.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

import numpy as np
import pygltflib

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.gltf.buffer import BufferBuilder
from usdface.io.gltf.document import GltfFile, item, resource
from usdface.io.gltf.image import GltfImage, pixels_of, to_png
from usdface.io.gltf.image_kind import image_type, is_cut_off_webp, is_webp
from usdface.io.gltf.target_names import legal_text
from usdface.io.inputs import first_free
from usdface.io.udim import is_udim
from usdface.io.unique_name import unique_name
from usdface.materials import Placement, Texture, Wrap

__all__ = ["TextureBuilder", "read_texture", "read_uv_names", "uv_name", "uv_name_extras"]

_TRANSFORM, _WEBP = "KHR_texture_transform", "EXT_texture_webp"
_SUFFIXES = {"image/png": ".png", "image/jpeg": ".jpg"}
# Constants of samplers: glTF 2.0, 5.26.
_WRAPS: dict[int, Wrap] = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
_WRAP_NUMBERS = {name: number for number, name in _WRAPS.items()}
_NAME, _MOST_SETS = re.compile(r"[^\W\d]\w{0,62}(:\w{1,62})*"), 64
_TAKEN = ("displayColor", "displayOpacity", "normals", "tangents")
_MAG, _MIN = (9728, 9729), (9728, 9729, 9984, 9985, 9986, 9987)


def uv_name(index: int, names: Sequence[str] = ()) -> str:
    """Return the name of TEXCOORD_`index`: of `names`, else st, st1, st2, ..., none twice."""
    return names[index] if index < len(names) else unique_name(f"st{index or ''}", names)


def uv_name_extras(names: Sequence[str]) -> dict[str, Any]:
    """Return the extras that name the texture coordinates, where they are not st, st1, ..."""
    plain = all(name == uv_name(place) for place, name in enumerate(names))
    return {} if plain else {"usdface": {"uvNames": list(names)}}


def read_uv_names(extras: Any) -> tuple[str, ...]:
    """Return the names that `uv_name_extras` wrote; none where they are malformed."""
    ours = extras.get("usdface") if isinstance(extras, dict) else None
    names = ours.get("uvNames") if isinstance(ours, dict) else None
    if not isinstance(names, list) or len(names) > _MOST_SETS:
        return ()
    sound = all(isinstance(n, str) and _NAME.fullmatch(n) and n not in _TAKEN for n in names)
    return tuple(names) if sound and len(set(names)) == len(names) else ()


# -- in ------------------------------------------------------------------------------------


def read_texture(
    file: GltfFile,
    info: Any,
    uv_names: Sequence[str],
    where: str,
    decoded: dict[int, Texture] | None,
) -> tuple[Texture | None, list[Finding]]:
    """Return the texture of a ``textureInfo``; None, with a finding at `where`, for no image.

    Embedded images come as bytes, images beside the file as its path. WebP, which USD does not
    read, becomes PNG (TEXTURE_CONVERTED), once for all that show it if they pass the same
    `decoded`; where it cannot be read the texture's other image serves.

    Raises
    ------
    InputError
        If a texture, image or sampler does not exist, or its data lie outside the file.
    """
    texture = item(file.document.textures or [], info.index, "texture")
    found: list[Finding] = []
    webp = (texture.extensions or {}).get(_WEBP)
    sources = [webp.get("source")] if isinstance(webp, dict) else []
    for source in (*sources, texture.source):
        if source is None:
            continue
        try:
            image = _image(file, source)
            if image.suffix == ".webp":
                decoded = {} if decoded is None else decoded
                image = _as_png(image, source, decoded, found)
        except _NoImage as error:
            code = "ASSET_OUTSIDE" if error.code == "URI_OUTSIDE" else "TEXTURE_MISSING"
            found.append(finding(code, where, "{error}; the texture is left out", error))
            continue
        placed = _placement(file, texture, info, uv_names)
        name = _name(item(file.document.images or [], source, "image"))
        return replace(image, placed=placed, image_name=name), found
    if not found:
        message = "its image is in a format that only an extension defines"
        found.append(finding("TEXTURE_MISSING", where, message))
    return None, found


def _as_png(
    image: Texture, source: int, decoded: dict[int, Texture], found: list[Finding]
) -> Texture:
    if source not in decoded:
        try:
            data = to_png(pixels_of(image))
        except InputError as error:
            raise _NoImage(f"image {source} is WebP: {error}") from error
        decoded[source] = Texture(data=data, suffix=".png")
        name = Path(image.path).name or f"image {source}"
        found.append(
            finding("TEXTURE_CONVERTED", name, "WebP, which USD does not read, is PNG now")
        )
    return decoded[source]


class _NoImage(InputError):
    """An image that is left out."""


def _image(file: GltfFile, index: object) -> Texture:
    image = item(file.document.images or [], index, "image")
    if image.bufferView is not None:
        view = item(file.document.bufferViews or [], image.bufferView, "bufferView")
        buffer = item(file.buffers, view.buffer, "buffer")
        start, length = view.byteOffset or 0, view.byteLength or 0
        if start < 0 or length < 0 or start + length > len(buffer):
            raise InputError(f"bufferView {image.bufferView} reaches beyond its buffer")
        data = buffer[start : start + length]
    elif image.uri is None:
        raise _NoImage(f"image {index} has neither a URI nor data")
    else:
        try:
            data = resource(image.uri, file.folder, file.asset_root)
        except InputError as error:
            raise _NoImage(str(error), error.code) from error
        place = file.folder / unquote(image.uri)
        # A path with a mark of UDIM would stand for other files than this one.
        if not image.uri.startswith("data:") and not is_udim(place) and not is_cut_off_webp(data):
            suffix = ".webp" if is_webp(data) else place.suffix
            return Texture(path=str(place), suffix=suffix)
    if is_cut_off_webp(data):
        raise _NoImage(f"image {index} is a WebP that is cut off")
    suffix = ".webp" if is_webp(data) else _SUFFIXES.get(image_type(data), "")
    return Texture(data=data, suffix=suffix)


def _placement(file: GltfFile, texture: Any, info: Any, uv_names: Sequence[str]) -> Placement:
    sampler = pygltflib.Sampler()
    if texture.sampler is not None:
        sampler = item(file.document.samplers or [], texture.sampler, "sampler")
    transform = (info.extensions or {}).get(_TRANSFORM) or {}
    number = transform.get("texCoord", info.texCoord or 0)
    if isinstance(number, bool) or not isinstance(number, int) or number < 0:
        raise InputError(f"a texture has texture coordinates {number!r}")
    scale = _pair(transform.get("scale", (1.0, 1.0)))
    across, down = _pair(transform.get("offset", (0.0, 0.0)))
    rotation = _pair((transform.get("rotation", 0.0), 0.0))[0]
    # In glTF v points down: turn about the other corner of the image.
    offset = (
        across + scale[1] * float(np.sin(rotation)),
        1 - down - scale[1] * float(np.cos(rotation)),
    )
    return Placement(
        uv_name(number, uv_names),
        (_WRAPS.get(sampler.wrapS, "repeat"), _WRAPS.get(sampler.wrapT, "repeat")),
        (
            sampler.magFilter if sampler.magFilter in _MAG else 0,
            sampler.minFilter if sampler.minFilter in _MIN else 0,
        ),
        scale,
        rotation,
        offset if transform else (0.0, 0.0),
        _name(texture),
    )


def _name(part: Any) -> str:
    return legal_text(str(part.name or ""))


def _pair(values: Any) -> tuple[float, float]:
    array = np.asarray(values, np.float64)
    if array.shape != (2,) or not np.isfinite(array).all():
        raise InputError(f"a texture transform is malformed: {values!r}")
    return float(array[0]), float(array[1])


# -- out -----------------------------------------------------------------------------------


class TextureBuilder:
    """Images, samplers and textures of a file that is being written; equal ones are stored once.

    An image without a name in glTF has that of its file.

    Parameters
    ----------
    uv_names : sequence of str
        Names of TEXCOORD_0, TEXCOORD_1, ... of the file.
    """

    def __init__(self, uv_names: Sequence[str]) -> None:
        self._uv_names = list(uv_names)
        self._images: dict[tuple[GltfImage, str], tuple[int, str]] = {}
        self._samplers: dict[tuple[int | None, ...], int] = {}
        self._textures: dict[tuple[int, int | None, str], int] = {}
        self.transformed = False
        self.findings: list[Finding] = []

    def info(self, kind: Any, image: GltfImage, texture: Texture, where: str) -> Any:
        """Return a ``textureInfo`` of a pygltflib `kind` for an image, placed as a texture."""
        placed = texture.placed
        title = texture.image_name or Path(texture.path).stem
        entry = len(self._images), title
        source, _ = self._images.setdefault((image, texture.image_name), entry)
        key = (source, self._sampler(placed), placed.texture_name)
        coordinates = 0
        if placed.uv in self._uv_names:
            coordinates = self._uv_names.index(placed.uv)
        elif placed.uv != "st" and self._uv_names:
            message = "no mesh has the texture coordinates {uv_set!r}; others are used"
            self.findings.append(
                finding(
                    "FEATURE_APPROXIMATED", where, message, placed.uv, feature="texture_coordinates"
                )
            )
        info = kind(index=self._textures.setdefault(key, len(self._textures)))
        info.texCoord = coordinates or None
        if placed.moved:
            self.transformed = True
            info.extensions = {_TRANSFORM: _transform(placed)}
        return info

    def _sampler(self, placed: Placement) -> int | None:
        wraps = tuple(_WRAP_NUMBERS[wrap] for wrap in placed.wrap)
        if (*wraps, *placed.filters) == (10497, 10497, 0, 0):
            return None
        key = (*(number or None for number in placed.filters), *wraps)
        return self._samplers.setdefault(key, len(self._samplers))

    def into(
        self,
        document: pygltflib.GLTF2,
        builder: BufferBuilder,
        path: Path,
        taken: Callable[[Path], bool],
    ) -> dict[str, bytes]:
        """Put all into a document at `path`; return the files that belong beside it.

        Images go into a GLB, beside a .gltf. Where a place is `taken`, by a file that was read,
        the image goes to the next one; if that file is the image itself, it serves as it is.
        """
        beside = {}
        numbers = count()
        for ((data, mime), _), (_, title) in self._images.items():
            if path.suffix.lower() == ".glb":
                image = pygltflib.Image(mimeType=mime, bufferView=builder.view(data))
            else:
                names = (f"{path.stem}_textures/{n}{_SUFFIXES[mime]}" for n in numbers)
                name, there = first_free(path.parent, names, data, taken)
                if not there:
                    beside[name] = data
                image = pygltflib.Image(uri=quote(name))
            image.name = title or None
            document.images.append(image)
        document.samplers = [
            pygltflib.Sampler(magFilter=mag, minFilter=min_, wrapS=s, wrapT=t)
            for mag, min_, s, t in self._samplers
        ]
        document.textures = [
            pygltflib.Texture(source=source, sampler=sampler, name=name or None)
            for source, sampler, name in self._textures
        ]
        if self.transformed:
            document.extensionsUsed = [*document.extensionsUsed, _TRANSFORM]
        return beside


def _transform(placed: Placement) -> dict[str, Any]:
    sine, cosine = float(np.sin(placed.rotation)), float(np.cos(placed.rotation))
    offset = (
        placed.offset[0] - placed.scale[1] * sine,
        1 - placed.offset[1] - placed.scale[1] * cosine,
    )
    return {"offset": list(offset), "rotation": placed.rotation, "scale": list(placed.scale)}
