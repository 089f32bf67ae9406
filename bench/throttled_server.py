"""A web server at the end of a slow line: the viewer's page and files in memory, at a rate that all answers share."""

from __future__ import annotations

import re
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import athcodec

WEB = Path(athcodec.__file__).parent / "viewer" / "web"
TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css"}
PIECE = 1460  # bytes of a packet


class ThrottledServer(ThreadingHTTPServer):
    """Serves the viewer, and `files` by name, on 127.0.0.1: a context manager.

    rate: bytes a second, None as fast as it goes; of files alone, so that the page can be there already. latency:
    seconds before an answer. ranges: whether byte ranges are known. `log`: (name, first byte, bytes sent) per answer.
    """

    daemon_threads = True
    block_on_close = False

    def __init__(self, files: dict[str, bytes], rate: float | None = None, latency: float = 0.0, ranges: bool = True):
        super().__init__(("127.0.0.1", 0), _Handler)
        self.files, self.rate, self.latency, self.ranges = files, rate, latency, ranges
        self.log: list[list] = []
        self._free, self._turn = 0.0, threading.Lock()

    def __enter__(self) -> ThrottledServer:
        threading.Thread(target=self.serve_forever, args=(0.02,), daemon=True).start()
        return self

    def __exit__(self, *_) -> None:
        self.shutdown()
        self.server_close()

    def handle_error(self, request, client_address) -> None:
        """A browser that closes a connection is none."""

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}/"

    def page(self, name: str | None = None, **more: str) -> str:
        """The viewer's address with a file."""
        asked = ([f"file=/{name}"] if name else []) + [f"{key}={value}" for key, value in more.items()]
        return self.address + ("?" + "&".join(asked) if asked else "")

    def sent(self, name: str) -> int:
        return sum(size for file, _, size in self.log if file == name)

    def wait(self, size: int) -> None:
        """Until `size` bytes more have gone through the line."""
        if self.rate is None:
            return
        with self._turn:
            self._free = max(self._free, time.monotonic()) + size / self.rate
            until = self._free
        time.sleep(max(0.0, until - time.monotonic()))


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True  # the end of an answer would wait 40 ms
    server: ThrottledServer

    def do_GET(self) -> None:
        name = self.path.split("?")[0].lstrip("/") or "index.html"
        if name in self.server.files:
            self._file(name, self.server.files[name])
        elif (WEB / name).is_file():
            self._answer(200, (WEB / name).read_bytes(), {"Content-Type": TYPES.get(Path(name).suffix, "text/plain")})
        else:
            self._answer(404, b"", {})

    def _file(self, name: str, data: bytes) -> None:
        time.sleep(self.server.latency)
        asked = re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers.get("Range", "")) if self.server.ranges else None
        first, last = (int(asked[1]), min(int(asked[2]), len(data) - 1)) if asked else (0, len(data) - 1)
        entry = [name, first, 0]
        self.server.log.append(entry)
        if first >= len(data):
            self._answer(416, b"", {"Content-Range": f"bytes */{len(data)}"})
            return
        headers = {"Content-Type": "application/octet-stream", "ETag": f'"{len(data)}"'}
        if asked:
            headers["Content-Range"] = f"bytes {first}-{last}/{len(data)}"
        self._answer(206 if asked else 200, data[first: last + 1], headers, entry)

    def _answer(self, status: int, body: bytes, headers: dict[str, str], entry: list | None = None) -> None:
        self.send_response(status)
        for name, value in (headers | {"Content-Length": str(len(body))}).items():
            self.send_header(name, value)
        self.end_headers()
        try:
            if entry is None:
                self.wfile.write(body)
            for at in range(0, len(body) if entry else 0, PIECE):
                piece = body[at: at + PIECE]
                self.server.wait(len(piece))
                self.wfile.write(piece)
                entry[2] += len(piece)
        except ConnectionError:
            self.close_connection = True

    def log_message(self, *_) -> None:
        pass
