"""A headless Chromium that opens pages from files: its DevTools protocol over a pipe.

One message is JSON that ends in a zero byte; the browser reads file descriptor 3 and writes 4.
"""

import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

__all__ = ["Page", "chromium_path", "open_browser"]

SECONDS = 120.0
FLAGS = (
    "--headless=new --no-sandbox --disable-quic --no-first-run --disable-sync --hide-scrollbars "
    "--disable-background-networking --disable-component-update --use-angle=swiftshader "
    "--enable-unsafe-swiftshader --remote-debugging-pipe"
)


def chromium_path() -> str | None:
    return shutil.which("chromium") or shutil.which("chromium-browser")


class Browser:
    """The pipe to a running browser."""

    def __init__(self, receive: int, send: int) -> None:
        self.receive, self.send = receive, send
        self.waiting = b""
        self.number = 0
        self.events: list[dict[str, Any]] = []

    def message(self, seconds: float) -> dict[str, Any]:
        end = time.monotonic() + seconds
        while b"\0" not in self.waiting:
            ready, _, _ = select.select([self.receive], [], [], max(0.0, end - time.monotonic()))
            if not ready:
                raise TimeoutError("the browser does not answer")
            self.waiting += os.read(self.receive, 1 << 20)
        first, _, self.waiting = self.waiting.partition(b"\0")
        answer: dict[str, Any] = json.loads(first)
        return answer

    def call(self, method: str, session: str = "", **parameters: Any) -> dict[str, Any]:
        self.number += 1
        asked = {"id": self.number, "method": method, "params": parameters}
        os.write(
            self.send,
            json.dumps(asked | ({"sessionId": session} if session else {})).encode() + b"\0",
        )
        while True:
            answer = self.message(SECONDS)
            if answer.get("id") == self.number:
                assert "error" not in answer, f"{method}: {answer['error']}"
                result: dict[str, Any] = answer["result"]
                return result
            self.events.append(answer)

    def page(self, path: Path, fragment: str = "", size: tuple[int, int] = (1280, 800)) -> "Page":
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        page = Page(self, session)
        for domain in ("Page", "Runtime", "Network", "Log"):
            page.call(f"{domain}.enable")
        page.resize(*size)
        page.call("Page.navigate", url=path.resolve().as_uri() + fragment)
        state = page.wait("document.body?.dataset.ready")
        assert state == "true", page.problems()
        return page


class Page:
    """One page of the browser."""

    def __init__(self, browser: Browser, session: str) -> None:
        self.browser, self.session = browser, session

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        return self.browser.call(method, self.session, **parameters)

    def run(self, expression: str) -> Any:
        """Evaluate an expression in the page; a promise is awaited."""
        answer = self.call(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait(self, expression: str, seconds: float = 60.0) -> Any:
        """Wait until an expression is true."""
        end = time.monotonic() + seconds
        while not (value := self.run(expression)):
            assert time.monotonic() < end, f"{expression} stays {value}; {self.problems()}"
            time.sleep(0.05)
        return value

    def picture(self) -> bytes:
        """The window as PNG."""
        self.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def canvas(self) -> bytes:
        """The canvas of the stage alone, as PNG."""
        url = self.run('usdface.stage.draw(), document.getElementById("canvas").toDataURL()')
        return base64.b64decode(url.partition(",")[2])

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Press the left button at a place of the window, move it to another and let go."""
        points = [
            start,
            *(
                (start[0] + (end[0] - start[0]) * k / 4, start[1] + (end[1] - start[1]) * k / 4)
                for k in range(1, 5)
            ),
        ]

        def send(kind: str, at: tuple[float, float], held: int) -> None:
            self.call(
                "Input.dispatchMouseEvent",
                type=kind,
                x=at[0],
                y=at[1],
                button="left",
                buttons=held,
                clickCount=1,
            )

        send("mouseMoved", start, 0)
        send("mousePressed", start, 1)
        for point in points[1:] if start != end else []:
            send("mouseMoved", point, 1)
        send("mouseReleased", end, 0)

    def key(self, key: str) -> None:
        """Press a key; Enter and the space bar also press a button that has the focus."""
        text = {"Enter": "\r"}.get(key, key if len(key) == 1 else "")
        code = {"Enter": 13, " ": 32}.get(key, 0)
        for kind, typed in (("keyDown", text), ("keyUp", "")):
            self.call(
                "Input.dispatchKeyEvent",
                type=kind,
                key=key,
                text=typed,
                windowsVirtualKeyCode=code,
            )

    def resize(self, width: int, height: int) -> None:
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )

    def requests(self) -> list[str]:
        """Every address that the page asked for."""
        self.run("1")
        return [
            event["params"]["request"]["url"]
            for event in self.browser.events
            if event["method"] == "Network.requestWillBeSent"
            and event.get("sessionId") == self.session
        ]

    def problems(self) -> list[str]:
        """Errors and warnings that the page logged."""
        found = []
        for event in self.browser.events:
            if event.get("sessionId") != self.session:
                continue
            if event["method"] == "Runtime.exceptionThrown":
                found.append(json.dumps(event["params"]["exceptionDetails"])[:2000])
            elif event["method"] == "Log.entryAdded" and event["params"]["entry"]["level"] in (
                "error",
                "warning",
            ):
                found.append(event["params"]["entry"]["text"])
            elif event["method"] == "Runtime.consoleAPICalled" and event["params"]["type"] in (
                "error",
                "warning",
            ):
                found.append(str(event["params"]["args"][0].get("value")))
        return found


@contextmanager
def open_browser(executable: str, downloads: Path | None = None) -> Iterator[Browser]:
    """Run Chromium for a while; downloads go to a folder."""
    ours_read, theirs_write = os.pipe()
    theirs_read, ours_write = os.pipe()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        # The shell puts the ends of the pipes at the numbers that Chromium expects.
        command = f'exec "$@" 3<&{theirs_read} 4>&{theirs_write}'
        process = subprocess.Popen(
            [
                "bash",
                "-c",
                command,
                "bash",
                executable,
                *FLAGS.split(),
                f"--user-data-dir={profile}",
                "about:blank",
            ],
            pass_fds=(theirs_read, theirs_write),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(theirs_read)
        os.close(theirs_write)
        try:
            browser = Browser(ours_read, ours_write)
            if downloads is not None:
                browser.call(
                    "Browser.setDownloadBehavior",
                    behavior="allow",
                    downloadPath=str(downloads),
                    eventsEnabled=True,
                )
            yield browser
        finally:
            process.terminate()
            process.wait(timeout=30)
            os.close(ours_read)
            os.close(ours_write)
