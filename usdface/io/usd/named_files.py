"""The files that a USD file names, as it names them, and those that are named but not there.

`usdface.io.usd.dependencies` gives the files themselves; a link that leads elsewhere tomorrow, or a
file that appears where USD looks first, shows only here.
"""

import os
from pathlib import Path

from pxr import Ar, Tf, UsdUtils

from usdface.io.usd.held_layers import hold_specs

__all__ = ["named_files"]


def named_files(path: Path) -> tuple[list[Path], list[Path]]:
    """Return the files that a stage names, by the paths that lead there, and the missing ones.

    Links are not followed. Missing are files that no path leads to, and those that would be taken
    instead of a file of the search path (``PXR_AR_DEFAULT_SEARCH_PATH``) if they were there.

    Parameters
    ----------
    path : Path
        A USD file that opens.

    Returns
    -------
    found, missing : list of Path
        Absolute.
    """
    delegate = UsdUtils.CoalescingDiagnosticDelegate()  # no word of USD's on standard error
    try:
        layers, assets, unresolved = UsdUtils.ComputeAllDependencies(str(path))
    except Tf.ErrorException:
        return [], []
    finally:
        del delegate
    for layer in layers:
        hold_specs(layer)
    names = [layer.realPath for layer in layers] + [str(asset) for asset in assets]
    outer = (Ar.SplitPackageRelativePathOuter(name)[0] for name in names if name)
    found = list(dict.fromkeys(Path(os.path.abspath(name)) for name in outer))  # noqa: PTH100
    missing = [Path(name) for name in unresolved if Path(name).is_absolute()]
    return found, [*missing, *_searched_before(found)]


def _searched_before(found: list[Path]) -> list[Path]:
    """Return the places where USD looks before it finds a file on the search path."""
    search = os.environ.get("PXR_AR_DEFAULT_SEARCH_PATH", "")
    folders = [Path(os.path.abspath(name)) for name in search.split(os.pathsep) if name]  # noqa: PTH100
    anchors = dict.fromkeys(file.parent for file in found)
    earlier = []
    for number, folder in enumerate(folders):
        for file in found:
            if file.is_relative_to(folder):
                name = file.relative_to(folder)
                earlier += [place / name for place in (*folders[:number], *anchors)]
    known = set(found)
    return [place for place in dict.fromkeys(earlier) if place not in known and not place.exists()]
