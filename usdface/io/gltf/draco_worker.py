"""Run as a script by `usdface.io.gltf.draco`: Draco data on standard input, .npz on output."""

import io
import struct
import sys

__all__ = ["main"]

_MOST_MEMORY = 4 * 2**30  # [bytes], address space of this process


def main() -> None:
    """Decode each mesh; one that cannot be decoded has no arrays."""
    import DracoPy
    import numpy as np

    _limit_memory()
    data = sys.stdin.buffer.read()
    arrays: dict[str, np.ndarray] = {}
    place = number = 0
    while place < len(data):
        (size,) = struct.unpack_from("<Q", data, place)
        blob = data[place + 8 : place + 8 + size]
        place += 8 + size
        try:
            mesh = DracoPy.decode(blob)
            own = {f"{number}/faces": mesh.faces}
            own |= {f"{number}/{a['unique_id']}": a["data"] for a in mesh.attributes}
            arrays |= {name: np.asarray(values) for name, values in own.items()}
        except Exception:  # whatever the library raises, the data are no Draco mesh
            pass
        number += 1
    held = io.BytesIO()
    np.savez(held, allow_pickle=False, **arrays)
    sys.stdout.buffer.write(held.getvalue())


def _limit_memory() -> None:
    try:
        import resource
    except ImportError:  # Windows
        return
    resource.setrlimit(resource.RLIMIT_AS, (_MOST_MEMORY, _MOST_MEMORY))


if __name__ == "__main__":
    main()
