"""Bundles the parts of three.js that the pages use: ``python .ci/three/build.py``.

Needs Node.js and npm, of developers only: the bundle is kept in
`usdface/page/assets/three.js`, and its SHA-256 in `three.sha256` beside it. ``--check`` compares
it with a new one and writes nothing.
"""

import hashlib
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

# Pinned: another version makes another bundle.
THREE, ESBUILD = "0.187.0", "0.28.2"
_HERE = Path(__file__).parent
_ASSETS = _HERE.parents[1] / "usdface" / "page" / "assets"


def build() -> str:
    """Return the bundle: three.js from npm, what `parts.js` exports, minified.

    Raises
    ------
    subprocess.CalledProcessError
        If npm or esbuild fails.
    """
    npm = shutil.which("npm")
    if npm is None:
        raise SystemExit("npm is not installed; only developers who build the bundle need it")
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        shutil.copy(_HERE / "parts.js", folder)
        packages = [f"three@{THREE}", f"esbuild@{ESBUILD}"]
        subprocess.run(
            [npm, "install", "--no-save", "--no-audit", "--no-fund", "--silent", *packages],
            cwd=folder,
            check=True,
        )
        bundler = folder / "node_modules" / ".bin" / "esbuild"
        options = ["--bundle", "--minify", "--format=esm", "--target=es2022"]
        made = subprocess.run(
            [bundler, "parts.js", *options, "--legal-comments=none"],
            cwd=folder,
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        licence = (folder / "node_modules" / "three" / "LICENSE").read_text(encoding="utf-8")
    return f"/*! three.js {THREE}\n\n{licence.strip()}\n*/\n{made}"


def main() -> int:
    """Write or check the bundle."""
    bundle = build().encode()
    digest = hashlib.sha256(bundle).hexdigest()
    if "--check" in sys.argv:
        same = (_ASSETS / "three.js").read_bytes() == bundle
        print("the bundle is that of npm" if same else "the bundle differs from that of npm")
        return 0 if same else 1
    (_ASSETS / "three.js").write_bytes(bundle)
    (_ASSETS / "three.sha256").write_text(f"{digest}  three.js\n", encoding="utf-8")
    print(f"three.js: {len(bundle)} bytes, {digest}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
