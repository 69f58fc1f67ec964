"""Programs that are not ours, as subprocesses with time limits; they skip where they are not."""

import base64
import json
import shutil
import subprocess
import tempfile
import threading
from collections.abc import Callable
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from queue import Queue
from subprocess import DEVNULL
from typing import Any
from urllib.parse import quote

import pytest

from usdface.cli import main

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
BLENDER = ROOT / ".venv-blender" / "bin" / "python"
SECONDS = 180


@pytest.fixture(scope="session")
def example(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example, processed in a folder of its own: shot.usdface.usda and face.glb."""
    folder = tmp_path_factory.mktemp("example")
    for name in ("head.usdc", "take.usdc", "shot.usda"):
        shutil.copy(ROOT / "examples" / name, folder)
    assert main(["process", str(folder / "shot.usda"), "--gltf", str(folder / "face.glb")]) == 0
    return folder


@pytest.fixture(scope="session")
def blender() -> Callable[..., dict[str, Any]]:
    """Import a file into Blender and return what its shape keys play, in a clip if one is named.

    With `points` also where all vertices are at the frames.
    """
    if not BLENDER.exists():
        pytest.skip("Blender (bpy) is not in .venv-blender; .ci/run puts it there")

    def read(path: Path, frames: list[int], clip: str = "", points: bool = False) -> dict[str, Any]:
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "answer.json"
            script = HERE / "blender_reader.py"
            command = [BLENDER, script, path, out, json.dumps(frames), clip]
            command += ["points"] if points else []
            done = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS)
            assert out.exists(), done.stderr[-2000:]
            return json.loads(out.read_text())

    return read


class _Files(SimpleHTTPRequestHandler):
    """Serves the page, the packages and one GLB to this machine; takes the page's answer."""

    glb = Path()
    answers: Queue[bytes]

    def translate_path(self, path: str) -> str:
        name = path.partition("?")[0]
        if name == "/face.glb":
            return str(self.glb)
        return str(HERE / "three.html" if name == "/" else ROOT / name.lstrip("/"))

    def do_POST(self) -> None:
        self.answers.put(self.rfile.read(int(self.headers["Content-Length"])))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture(scope="session")
def three() -> Callable[..., dict[str, Any]]:
    """Load a GLB in three.js in a headless Chromium; return morph influences and a picture.

    The function takes the GLB, the times [s] of the influences, that of the picture, maybe the
    one clip to play, and whether to return the points of all meshes in the scene at the times, too.
    """
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if not chromium:
        pytest.skip("chromium is not installed; .ci/run installs it")
    if not (ROOT / "node_modules" / "three").is_dir():
        pytest.skip("three is not in node_modules; npm install --no-save three")

    def read(
        path: Path, times: list[float], draw: float, clip: str = "", points: bool = False
    ) -> dict[str, Any]:
        answers: Queue[bytes] = Queue()
        handler = type("Files", (_Files,), {"glb": path, "answers": answers})
        server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        flags = (
            "--headless=new --no-sandbox --disable-quic --no-first-run --disable-sync "
            "--disable-background-networking --disable-component-update "
            "--use-angle=swiftshader --enable-unsafe-swiftshader"
        )
        query = f"times={quote(json.dumps(times))}&draw={draw}&clip={quote(clip)}"
        query += "&points=1" if points else ""
        address = f"http://127.0.0.1:{server.server_port}/?{query}"
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
            command = [chromium, *flags.split(), f"--user-data-dir={profile}", address]
            browser = subprocess.Popen(command, stdout=DEVNULL, stderr=DEVNULL)
            try:
                answer = json.loads(answers.get(timeout=SECONDS))
            finally:
                browser.terminate()
                browser.wait(timeout=30)
                server.shutdown()
                server.server_close()
        assert "error" not in answer, answer["error"]
        answer["picture"] = base64.b64decode(answer["picture"].partition(",")[2])
        return answer

    return read
