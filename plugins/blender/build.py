"""Build the extension for Blender, or install what it needs beside a Blender.

    python plugins/blender/build.py -o usdface-linux-x64.zip [--platform linux-x64]
    python plugins/blender/build.py --target DIR

The zip is what *Install from Disk* of Blender's extensions takes: this folder's `extension`, with
wheels of usdface and its dependencies. It leaves out what Blender brings: pxr, numpy, OpenImageIO
(`host.toml`). With `--target` the same packages are installed into a folder, for a Blender that has
no extensions: put it on PYTHONPATH, or append it to `sys.path`, behind Blender's own.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from importlib.util import find_spec
from pathlib import Path

HERE = Path(__file__).resolve().parent
PROJECT = HERE.parents[1]
EXTENSION = HERE / "extension"


def main() -> None:
    """Build or install."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    host = tomllib.loads((HERE / "host.toml").read_text())
    place = parser.add_mutually_exclusive_group(required=True)
    place.add_argument("-o", "--output", type=Path, metavar="ZIP")
    place.add_argument("--target", type=Path, metavar="DIR")
    parser.add_argument("--platform", choices=sorted(host["platforms"]), default="linux-x64")
    parsed = parser.parse_args()
    if find_spec("pip") is None:  # as in the environment that the README makes
        parser.error(f"{sys.executable} has no pip; run this with a Python that has pip")
    blender = host["blender"][0]
    with tempfile.TemporaryDirectory() as folder:
        wheels = get_wheels(Path(folder), blender, host["platforms"][parsed.platform])
        if parsed.output:
            write_zip(parsed.output, wheels, parsed.platform)
        else:
            pip(
                "install",
                "--no-deps",
                "--upgrade",
                "--target",
                str(parsed.target),
                *only(blender, host["platforms"][parsed.platform]),
                *map(str, wheels),
            )
    print(f"wrote {parsed.output or parsed.target}: {len(wheels)} packages")


def get_wheels(folder: Path, blender: dict, platforms: list[str]) -> list[Path]:
    """Build the wheel of usdface and download those of its dependencies that Blender lacks."""
    pip("wheel", "--no-deps", "--wheel-dir", str(folder), str(PROJECT))
    (own,) = folder.glob("usdface-*.whl")
    plan = folder / "plan.json"
    pins = folder / "pins.txt"
    pins.write_text("\n".join(blender["pins"]))
    chosen = only(blender, platforms)
    pip(
        "install",
        "--dry-run",
        "--ignore-installed",
        "--report",
        str(plan),
        "--target",
        str(folder / "none"),
        "-c",
        str(pins),
        *chosen,
        str(own),
    )
    needed = [
        f"{item['metadata']['name']}=={item['metadata']['version']}"
        for item in json.loads(plan.read_text())["install"]
    ]
    left_out = {canonical(name) for name in (*blender["leave_out"], "usdface")}
    listed = [line for line in needed if canonical(line.partition("==")[0]) not in left_out]
    pip("download", "--no-deps", "--dest", str(folder), *chosen, *listed)
    return sorted(folder.glob("*.whl"))


def only(blender: dict, platforms: list[str]) -> list[str]:
    """Return the options of pip for wheels of one Python and platform."""
    named = [word for name in platforms for word in ("--platform", name)]
    return ["--only-binary", ":all:", "--python-version", blender["python"], *named]


def write_zip(path: Path, wheels: list[Path], platform: str) -> None:
    """Write the extension with its wheels."""
    listed = "".join(f'  "./wheels/{wheel.name}",\n' for wheel in wheels)
    head, bracket, permissions = (
        (EXTENSION / "blender_manifest.toml").read_text().partition("[permissions]")
    )
    manifest = f'{head}platforms = ["{platform}"]\nwheels = [\n{listed}]\n\n{bracket}{permissions}'
    tomllib.loads(manifest)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as package:
        package.writestr("blender_manifest.toml", manifest)
        for source in sorted(EXTENSION.glob("*.py")):
            package.write(source, source.name)
        package.write(PROJECT / "LICENSE", "LICENSE")
        for wheel in wheels:
            package.write(wheel, f"wheels/{wheel.name}", zipfile.ZIP_STORED)


def pip(*words: str) -> None:
    """Run pip."""
    subprocess.run([sys.executable, "-m", "pip", "-q", *words], check=True)


def canonical(name: str) -> str:
    """Return the name of a package as registries compare it."""
    return name.lower().replace("_", "-")


if __name__ == "__main__":
    main()
