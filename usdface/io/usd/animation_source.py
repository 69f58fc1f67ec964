"""The SkelAnimation of a result where the rig has none."""

from pxr import Sdf, Usd, UsdSkel

from usdface.io.usd.shot import ShotPrims

__all__ = ["add_applied_schema", "define_animation"]

_SCHEMAS = "apiSchemas"


def define_animation(
    layer: Sdf.Layer, stage: Usd.Stage, animation: Sdf.PrimSpec, prims: ShotPrims
) -> None:
    """Define the SkelAnimation of a rig that has none, and bind it so that UsdSkel finds it.

    UsdSkel reads `skel:animationSource` only of prims that SkelBindingAPI is applied to.
    """
    animation.specifier, animation.typeName = Sdf.SpecifierDef, "SkelAnimation"
    for path in dict.fromkeys((prims.skel_root, prims.skeleton)):
        owner = Sdf.CreatePrimInLayer(layer, path)
        source = Sdf.RelationshipSpec(owner, "skel:animationSource", custom=False)
        source.targetPathList.explicitItems = [animation.path]
        if not stage.GetPrimAtPath(path).HasAPI(UsdSkel.BindingAPI):
            add_applied_schema(owner, "SkelBindingAPI")


def add_applied_schema(spec: Sdf.PrimSpec, name: str) -> None:
    """Apply a schema on a prim's spec, before those that it or weaker layers apply."""
    schemas = spec.GetInfo(_SCHEMAS) if spec.HasInfo(_SCHEMAS) else Sdf.TokenListOp()
    if name in schemas.GetAddedOrExplicitItems():
        return
    if schemas.isExplicit:
        schemas.explicitItems = [name, *schemas.explicitItems]
    else:
        schemas.prependedItems = [name, *schemas.prependedItems]
    spec.SetInfo(_SCHEMAS, schemas)
