"""Cameras and lights of glTF, read and written.

Source: glTF 2.0 specification, section 3.10 (cameras); KHR_lights_punctual.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pygltflib
from pygltflib import GLTF2, Node

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.geometry.rigid_fit import mean_scale
from usdface.io.gltf.document import item
from usdface.io.gltf.extras import extras_with_metadata, read_extras
from usdface.io.gltf.nodes import NodeTree
from usdface.io.gltf.target_names import legal_text
from usdface.io.transforms import decompose, rigid
from usdface.scene import Camera, Light, LightKind

__all__ = ["read_scene", "write_scene"]

_LIGHTS = "KHR_lights_punctual"
_KINDS: tuple[LightKind, ...] = ("directional", "point", "spot")


# -- in ------------------------------------------------------------------------------------


def read_scene(
    document: GLTF2, tree: NodeTree, moved: frozenset[int] | set[int]
) -> tuple[tuple[Camera, ...], tuple[Light, ...], list[Finding]]:
    """Return the cameras and lights of the default scene where they stand at rest.

    Parameters
    ----------
    document : pygltflib.GLTF2
    tree : NodeTree
    moved : set of int
        Animated nodes; cameras and lights below them stay at rest, with a finding.

    Raises
    ------
    InputError
        If a camera or light does not exist or its numbers make no sense.
    """
    cameras: list[Camera] = []
    lights: list[Light] = []
    found: list[Finding] = []
    known = ((document.extensions or {}).get(_LIGHTS) or {}).get("lights") or []
    for index in tree.order:
        if index not in tree.scene:
            continue
        node = document.nodes[index]
        shining = (node.extensions or {}).get(_LIGHTS)
        if node.camera is None and shining is None:
            continue
        matrix, name = tree.worlds[index], node.name or f"node {index}"
        if _above(index, tree) & moved:
            message = "it stands still: its node is animated, which is not kept"
            found.append(finding("ANIMATION_DROPPED", name, message))
        if node.camera is not None:
            source = item(document.cameras or [], node.camera, "camera")
            extras, new_findings = read_extras(source.extras, node.extras, where=name)
            name, own = _names(node.name, source.name, "Camera")
            cameras.append(replace(_camera(source, name, matrix, extras), content_name=own))
            found += new_findings
        if shining is not None:
            given = item(known, shining.get("light"), "light")
            extras, new_findings = read_extras(given.get("extras"), node.extras, where=name)
            name, own = _names(node.name, given.get("name"), "Light")
            lights.append(replace(_light(given, name, matrix, extras), content_name=own))
            found += new_findings
    return tuple(cameras), tuple(lights), found


def _names(of_node: Any, own: Any, default: str) -> tuple[str, str]:
    """Return the name of a node, and that of its content where it is another one."""
    name, content = legal_text(str(of_node or own or default)), legal_text(str(own or ""))
    return name, content if content != name else ""


def _above(index: int, tree: NodeTree) -> set[int]:
    chain = set()
    while index >= 0:
        chain.add(index)
        index = tree.parents[index]
    return chain


def _camera(
    source: pygltflib.Camera, name: str, matrix: FloatArray, extras: dict[str, Any]
) -> Camera:
    scale = mean_scale(matrix[:3, :3])
    flat, deep = source.orthographic, source.perspective
    if source.type == "perspective" and deep is not None:
        far = np.inf if deep.zfar is None else _positive(deep.zfar, name)
        aspect = _positive(deep.aspectRatio, name) if deep.aspectRatio else 0.0
        numbers = _positive(deep.yfov, name), aspect
        return Camera(name, rigid(matrix), *numbers, _positive(deep.znear, name), far, True, extras)
    if source.type == "orthographic" and flat is not None:
        across, up = (abs(_positive(abs(v), name)) for v in (flat.xmag, flat.ymag))
        near, far = float(flat.znear) * scale, _positive(flat.zfar, name) * scale
        return Camera(name, rigid(matrix), 2 * up * scale, across / up, near, far, False, extras)
    raise InputError(f"camera {name!r} is neither perspective nor orthographic")


def _positive(value: Any, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < 1e30:
        raise InputError(f"camera {name!r} has the number {value!r}; expected one above 0")
    return float(value)


def _light(given: dict[str, Any], name: str, matrix: FloatArray, extras: dict[str, Any]) -> Light:
    kind = given.get("type")
    if kind not in _KINDS:
        raise InputError(f"light {name!r} is of type {kind!r}; expected {', '.join(_KINDS)}")
    cone = given.get("spot") or {}
    numbers = [*(given.get("color") or (1, 1, 1)), given.get("intensity", 1.0)]
    numbers += [cone.get("innerConeAngle", 0.0), cone.get("outerConeAngle", np.pi / 4)]
    numbers += [1.0 if given.get("range") is None else given["range"]]
    values = np.asarray(numbers, np.float64)
    if values.shape != (7,) or not np.isfinite(values).all() or (values < 0).any():
        raise InputError(f"light {name!r} has numbers that make no sense")
    red, green, blue, intensity, inner, outer, reach = values.tolist()
    scale = mean_scale(matrix[:3, :3])
    reach = reach * scale if given.get("range") is not None else np.inf
    return Light(
        name, kind, rigid(matrix), (red, green, blue), intensity, inner, outer, reach, extras
    )


# -- out -----------------------------------------------------------------------------------


def write_scene(
    cameras: Sequence[Camera], lights: Sequence[Light], document: GLTF2, roots: list[int]
) -> None:
    """Append a node for each camera and light, and add them to `roots`.

    Their matrices neither scale nor mirror.
    """
    for camera in cameras:
        roots.append(len(document.nodes))
        node = _node(camera.name, camera.matrix)
        node.camera = len(document.cameras)
        node.extras = extras_with_metadata(camera.extras)
        document.nodes.append(node)
        document.cameras.append(_written_camera(camera))
    if not lights:
        return
    document.extensions[_LIGHTS] = {"lights": [_written_light(light) for light in lights]}
    document.extensionsUsed = [*document.extensionsUsed, _LIGHTS]
    for number, light in enumerate(lights):
        roots.append(len(document.nodes))
        node = _node(light.name, light.matrix)
        node.extensions = {_LIGHTS: {"light": number}}
        node.extras = extras_with_metadata(light.extras)
        document.nodes.append(node)


def _node(name: str, matrix: FloatArray) -> Node:
    translation, rotation, _ = decompose(matrix)
    return Node(name=name, translation=translation.tolist(), rotation=rotation.tolist())


def _written_camera(camera: Camera) -> pygltflib.Camera:
    far = camera.far if np.isfinite(camera.far) else None
    name = camera.content_name or camera.name
    if camera.perspective:
        deep = pygltflib.Perspective(
            yfov=camera.height, aspectRatio=camera.aspect or None, znear=camera.near, zfar=far
        )
        return pygltflib.Camera(name=name, type="perspective", perspective=deep)
    up = camera.height / 2
    flat = pygltflib.Orthographic(
        xmag=up * (camera.aspect or 1.0), ymag=up, znear=camera.near, zfar=far or 1e6
    )
    return pygltflib.Camera(name=name, type="orthographic", orthographic=flat)


def _written_light(light: Light) -> dict[str, Any]:
    written: dict[str, Any] = {
        "name": light.content_name or light.name,
        "type": light.kind,
        "color": list(light.colour),
        "intensity": light.intensity,
    }
    if np.isfinite(light.reach) and light.kind != "directional":
        written["range"] = light.reach
    if light.kind == "spot":
        outer = min(light.outer, np.pi / 2)
        inner = min(light.inner, outer - 1e-6)  # the specification wants them apart
        written["spot"] = {"innerConeAngle": max(inner, 0.0), "outerConeAngle": outer}
    return written
