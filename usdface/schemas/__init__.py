"""The USD schemas of usdface: codeless typed prims, and how USD gets to know them.

Files are read and written alike with and without them: attributes are authored in full, and a root
layer that went through `write_fallback_types` names a fallback type of each prim for a program that
has no usdface. Registered, the schemas add defaults, documentation and type checks.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from usdface.errors import SchemaError
from usdface.schemas.tokens import FALLBACK_TYPES

if TYPE_CHECKING:
    from pxr import Sdf

__all__ = ["plugin_dir", "register", "write_fallback_types"]

_PLUGIN = "usdFace"  # "Name" in plugInfo.json


def plugin_dir() -> Path:
    """Return the folder to put on PXR_PLUGINPATH_NAME; USD is not loaded.

    Raises
    ------
    SchemaError
        If this package is in an archive, as of zipapp: USD reads files only.
    """
    folder = Path(__file__).parent
    if not folder.is_dir():
        raise SchemaError(
            f"USD cannot read the schemas in {folder}: usdface runs from within an archive; "
            "unpack it, or install it by pip"
        )
    return folder


def register() -> None:
    """Make the schemas known to USD, unless the environment or an earlier call did so.

    It looks the types up afterwards, which closes USD's schema registry for good: a host that
    registers other schemas at run time does so before.

    Raises
    ------
    SchemaError
        If it is too late, because a stage with prims was opened before, or if this package is in an
        archive.

    References
    ----------
    OpenUSD, ``UsdSchemaRegistry``: the registry is built once, on first use, from the plugins
    known by then.
    """
    from pxr import Plug, Tf, Usd

    folder = plugin_dir()
    plugins = Plug.Registry()
    if not plugins.GetPluginWithName(_PLUGIN):
        try:
            plugins.RegisterPlugins(str(folder))
        except Tf.ErrorException as error:
            raise SchemaError(f"USD cannot read the schemas in {folder}") from error
    registry = Usd.SchemaRegistry()
    unknown = [name for name in FALLBACK_TYPES if not registry.FindConcretePrimDefinition(name)]
    if unknown:
        raise SchemaError(
            f"USD does not know {', '.join(unknown)}: its schema registry was built before the "
            "usdface schemas were registered. Call usdface.schemas.register() before the first "
            f"stage is opened, or start the program with {folder} on PXR_PLUGINPATH_NAME"
        )


def write_fallback_types(root_layer: "Sdf.Layer") -> None:
    """Author the fallback types of usdface prims on a root layer, for programs without usdface.

    Unlike ``Usd.Stage.WriteFallbackPrimTypes`` it needs no registered schemas. Entries of
    other schemas, and of ours that are there already, are kept.
    """
    from pxr import Usd, Vt

    root = root_layer.pseudoRoot
    key = Usd.Tokens.fallbackPrimTypes
    # USD takes token arrays only: string arrays are refused
    ours = {name: Vt.TokenArray([fallback]) for name, fallback in FALLBACK_TYPES.items()}
    there = dict(root.GetInfo(key)) if root.HasInfo(key) else {}
    root.SetInfo(key, ours | there)
