"""A page in a browser, from a server on this machine: a script in it says what it sees."""

from __future__ import annotations

import contextlib
import json
import queue
import shutil
import subprocess
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

#: what a reader does; `say` sends a value to the test, `until` waits for a condition
READER = """<script type="module">
const say = value => fetch("/said", { method: "POST", body: JSON.stringify(value) });
const until = async condition => { while (!condition())
  await new Promise(done => setTimeout(done, 20)); };
const $ = selector => document.querySelector(selector);
const status = () => $("[role=status]")?.textContent ?? "";
addEventListener("error", event => say({ error: event.message }));
addEventListener("unhandledrejection", event => say({ error: String(event.reason) }));
%s
</script>"""


class _Handler(SimpleHTTPRequestHandler):
    """Files of a folder, and what a page says."""

    said: queue.Queue[Any]

    def do_POST(self) -> None:
        self.said.put(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *_: object) -> None:
        pass


@contextlib.contextmanager
def served(folder: Path) -> Iterator[tuple[str, queue.Queue[Any]]]:
    """Serve a folder on this machine; yields its address and what its pages say."""
    said: queue.Queue[Any] = queue.Queue()
    handler = type("Handler", (_Handler,), {"said": said})
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(handler, directory=str(folder)))
    thread = threading.Thread(target=server.serve_forever, args=(0.05,))
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}", said
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def found_browser() -> str:
    """Return the browser; `make browser` installs one."""
    names = ("chromium", "chromium-browser", "google-chrome", "chrome")
    mac = "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome"
    found = next((path for name in (*names, mac) if (path := shutil.which(name))), None)
    assert found, "this test needs a browser: apt install chromium"
    return found


def used(browser: str, folder: Path, page: str, script: str, profile: Path) -> Any:
    """Return what a script in a page says, {"error": ...} if something fails there."""
    index = folder / "index.html"
    whole = index.read_text("utf-8")
    index.write_text(whole + READER % script, "utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run"]
    with served(folder) as (address, said):
        process = subprocess.Popen(
            [browser, *options, "--remote-debugging-port=0", f"--user-data-dir={profile}",
             f"{address}/{page}"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        try:
            return said.get(timeout=60)
        finally:
            process.terminate()
            process.wait(10)
            index.write_text(whole, "utf-8")
