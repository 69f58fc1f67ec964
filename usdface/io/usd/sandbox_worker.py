"""Run as a script by `usdface.io.usd.sandbox`: opens a USD file as we do, and reads all of it.

Prints JSON: ``{"files": [...]}``, or ``{"refused": "..."}``. Also a file that USD itself refuses is
not to be opened again: without limits that may take any memory.
"""

import json
import os
import stat
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

__all__ = ["main"]

_MEMORY, _MEMORY_PER_BYTE = 300 * 2**20, 10  # bytes, of data
_SECONDS, _SECONDS_PER_BYTE = 6, 1 / 5e6  # of processor time
_STACK = 4 * 2**20  # bytes: half of the program's


class _Refused(Exception):
    """The file is not to be opened."""


def main() -> None:
    """Open the file that the first argument names."""
    from pxr import Sdf, Tf, Usd, UsdUtils

    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    limits = _Limits()
    answer: dict[str, Any] = {}
    files: dict[str, int] = {}
    name = root = os.path.realpath(sys.argv[1])
    try:
        for name in _layers(root, files, limits):
            with suppress(UnicodeError):
                layer = Sdf.Layer.FindOrOpen(name)
                if layer:
                    _read(layer)
        name = root
        with suppress(UnicodeError):
            stage = Usd.Stage.Open(sys.argv[1])
            for _ in stage.TraverseAll() if stage else ():
                pass
        answer = {"files": [name for name in files if Path(name).is_file()]}
    except Tf.ErrorException as error:
        first = _first(error)
        where = "" if name == root else f"brings in {name}, which "
        answer = {"refused": f"{where}cannot be read as USD: {first}", "code": "FILE_UNREADABLE"}
        if "bad_alloc" in first:
            answer = {"refused": limits.exceeded()}
    except _Refused as error:
        answer = {"refused": str(error), "code": "FILE_UNREADABLE"}
    except MemoryError:
        answer = {"refused": limits.exceeded()}
    del delegate
    sys.stdout.buffer.write(json.dumps(answer).encode())
    sys.stdout.flush()
    os._exit(0)  # memory need not be freed


class _Limits:
    """Memory and time of this process, which grow with the files."""

    def __init__(self) -> None:
        self.memory = self.used = 0
        self.grow(0)

    def exceeded(self) -> str:
        """Return the word for a file that takes more memory."""
        return f"takes more than {self.memory >> 20} MB of memory to open; is it damaged?"

    def grow(self, size: int) -> None:
        """Allow for a file of `size` bytes more."""
        self.used += size
        self.memory = _MEMORY + _MEMORY_PER_BYTE * self.used
        try:
            import resource
        except ImportError:  # Windows
            return
        seconds = int(_SECONDS + _SECONDS_PER_BYTE * self.used) + 1
        for kind, most in (
            (resource.RLIMIT_CPU, seconds),
            (resource.RLIMIT_DATA, self.memory + 2**27),  # and the libraries
            (resource.RLIMIT_STACK, _STACK),
            (resource.RLIMIT_CORE, 0),
        ):
            with suppress(OSError, ValueError):
                hard = resource.getrlimit(kind)[1]
                bounded = most if hard == resource.RLIM_INFINITY else min(most, hard)
                resource.setrlimit(kind, (bounded, hard))


def _layers(root: str, files: dict[str, int], limits: _Limits) -> Iterator[str]:
    """Yield the root layer and all that it leads to, each before those that it names."""
    from pxr import Ar, Sdf, UsdUtils

    waiting = [root]
    while waiting:
        name = waiting.pop(0)
        outer = Ar.SplitPackageRelativePathOuter(name)[0]
        if name in files:
            continue
        try:
            status = Path(outer).stat()
        except (OSError, ValueError):
            continue
        if not stat.S_ISREG(status.st_mode):
            raise _Refused(f"names {outer}, which is no regular file")
        files[name] = status.st_size
        limits.grow(status.st_size)
        if Sdf.FileFormat.FindByExtension(name) is None:
            continue
        yield name
        with suppress(UnicodeError):
            layer = Sdf.Layer.FindOrOpen(name)
            if not layer:
                continue
            sublayers, references, payloads = UsdUtils.ExtractExternalReferences(name)
            for asset in (*sublayers, *references, *payloads):
                place = Sdf.ComputeAssetPathRelativeToLayer(layer, asset)
                resolved = str(Ar.GetResolver().Resolve(place))
                if resolved and Sdf.FileFormat.FindByExtension(resolved) is not None:
                    waiting.append(resolved)


def _read(layer: Any) -> None:
    """Read every value of a layer, which USD does lazily."""
    from pxr import Tf

    paths: list[Any] = []
    layer.Traverse(layer.pseudoRoot.path, paths.append)
    for path in paths:
        try:
            spec = layer.GetObjectAtPath(path)
            for key in spec.ListInfoKeys() if spec else ():
                if key != "timeSamples":
                    with suppress(UnicodeError, TypeError, ValueError):  # no value of Python's
                        spec.GetInfo(key)
            for code in layer.ListTimeSamplesForPath(path) if path.IsPropertyPath() else ():
                with suppress(UnicodeError, TypeError, ValueError):
                    layer.QueryTimeSample(path, code)
        except Tf.ErrorException as error:
            raise _Refused(f"holds a value that cannot be read: {_first(error)}") from error


def _first(error: Exception) -> str:
    """Return the first of USD's errors, without its C++ context."""
    with suppress(UnicodeError, AttributeError, IndexError):
        return str(error.args[0].commentary).splitlines()[0][:200]
    return "damaged"


if __name__ == "__main__":
    main()
