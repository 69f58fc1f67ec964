"""Materials into USD: UsdPreviewSurface with textures beside the file."""

import hashlib
import re
from collections.abc import Iterable
from pathlib import Path

from pxr import Gf, Sdf, Usd, UsdShade

from usdface.findings import Finding, finding
from usdface.io.atomic import write_bytes
from usdface.io.prim_names import prim_names
from usdface.rigs import Material, Texture

__all__ = ["write_materials"]

_FLOAT = Sdf.ValueTypeNames.Float
_COLOR = Sdf.ValueTypeNames.Color3f
_RAW, _SRGB = "raw", "sRGB"


def write_materials(
    stage: Usd.Stage, scope: str, materials: tuple[Material, ...], target: Path
) -> tuple[dict[str, UsdShade.Material], list[Finding]]:
    """Define `materials` below the prim path `scope`; return them by original name.

    Textures inside the folder of `target` (the file that the stage will be saved to) are
    referenced relative to it; others, and those held as bytes, are copied to
    `<stem>_textures` beside it, so that the result can be moved as one.

    Raises
    ------
    OutputError
        If a texture cannot be written.
    """
    findings: list[Finding] = []
    files = _TextureFiles(target, findings)
    made: dict[str, UsdShade.Material] = {}
    for name, material in zip(prim_names(m.name for m in materials), materials, strict=True):
        prim = UsdShade.Material.Define(stage, f"{scope}/{name}")
        if name != material.name:
            prim.GetPrim().SetDisplayName(material.name)
            findings.append(finding("NAME_CHANGED", str(prim.GetPath()), f"was {material.name!r}"))
        _write_surface(prim, material, files)
        made.setdefault(material.name, prim)
    return made, findings


class _TextureFiles:
    """Where the textures of one stage lie, as asset paths; equal bytes are one file."""

    def __init__(self, target: Path, findings: list[Finding]) -> None:
        self._target = target
        self._findings = findings
        self._written: dict[str, str] = {}

    def asset(self, texture: Texture, name: str) -> str:
        """Return the asset path, "" where the file cannot be read."""
        folder = self._target.parent.resolve()
        data, suffix = texture.data, texture.suffix
        if data is None:
            path = Path(texture.path).resolve()
            if path.is_file() and path.is_relative_to(folder):
                return f"./{path.relative_to(folder).as_posix()}"
            try:
                data, suffix = path.read_bytes(), path.suffix
            except OSError as error:
                message = f"{path}: {error.strerror}; the texture is left out"
                self._findings.append(finding("TEXTURE_MISSING", name, message))
                return ""
        key = hashlib.sha256(data).hexdigest()
        if key not in self._written:
            kind = "." + re.sub("[^a-z0-9]", "", suffix.lower())
            place = f"{self._target.stem}_textures/{name}{kind if len(kind) > 1 else ''}"
            write_bytes(folder / place, data)
            self._written[key] = f"./{place}"
        return self._written[key]


def _write_surface(prim: UsdShade.Material, material: Material, files: _TextureFiles) -> None:
    stage, path = prim.GetPrim().GetStage(), prim.GetPath()
    surface = UsdShade.Shader.Define(stage, path.AppendChild("Surface"))
    surface.CreateIdAttr("UsdPreviewSurface")
    prim.CreateSurfaceOutput().ConnectToSource(
        surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    )
    for name, kind, value in (
        ("diffuseColor", _COLOR, Gf.Vec3f(*material.base_color)),
        ("emissiveColor", _COLOR, Gf.Vec3f(*material.emissive)),
        ("metallic", _FLOAT, material.metallic),
        ("roughness", _FLOAT, material.roughness),
        ("opacity", _FLOAT, material.opacity),
    ):
        surface.CreateInput(name, kind).Set(value)
    one = (1.0, 1.0, 1.0)
    factors = (1.0, material.roughness, material.metallic)
    # Packed channels as in glTF: occlusion in r, roughness in g, metallic in b.
    for role, texture, scale, space, inputs in (
        ("baseColor", material.base_color_texture, material.base_color, _SRGB,
         (("diffuseColor", _COLOR, "rgb"),)),
        ("emissive", material.emissive_texture, material.emissive, _SRGB,
         (("emissiveColor", _COLOR, "rgb"),)),
        ("metallicRoughness", material.metallic_roughness_texture, factors, _RAW,
         (("roughness", _FLOAT, "g"), ("metallic", _FLOAT, "b"))),
        ("occlusion", material.occlusion_texture, one, _RAW, (("occlusion", _FLOAT, "r"),)),
        ("normal", material.normal_texture, (2.0, 2.0, 2.0), _RAW,
         (("normal", Sdf.ValueTypeNames.Normal3f, "rgb"),)),
    ):  # fmt: skip
        asset = files.asset(texture, f"{path.name}_{role}") if texture else ""
        if asset:
            reader = _texture_reader(prim, role, asset, scale, space)
            for name, kind, channel in inputs:
                _connect(surface, name, kind, reader, channel)


def _connect(
    surface: UsdShade.Shader,
    name: str,
    kind: Sdf.ValueTypeName,
    reader: UsdShade.Shader,
    channel: str,
) -> None:
    output = Sdf.ValueTypeNames.Float3 if channel == "rgb" else _FLOAT
    surface.CreateInput(name, kind).ConnectToSource(reader.CreateOutput(channel, output))


def _texture_reader(
    prim: UsdShade.Material, role: str, asset: str, scale: Iterable[float], space: str
) -> UsdShade.Shader:
    stage, path = prim.GetPrim().GetStage(), prim.GetPath()
    st = UsdShade.Shader.Define(stage, path.AppendChild("st"))
    st.CreateIdAttr("UsdPrimvarReader_float2")
    st.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
    reader = UsdShade.Shader.Define(stage, path.AppendChild(role))
    reader.CreateIdAttr("UsdUVTexture")
    reader.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(asset))
    reader.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(
        st.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    )
    for wrap in ("wrapS", "wrapT"):
        reader.CreateInput(wrap, Sdf.ValueTypeNames.Token).Set("repeat")
    reader.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set(space)
    reader.CreateInput("scale", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(*scale, 1.0))
    if role == "normal":  # stored 0 to 1, meant -1 to 1
        reader.CreateInput("bias", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(-1, -1, -1, 0))
    return reader
