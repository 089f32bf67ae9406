"""A web server with a limited transfer rate, shared by all responses: the viewer's page, and files in memory."""

from __future__ import annotations

import re
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import unquote

import athcodec

WEB = Path(athcodec.__file__).parent / "viewer" / "web"
TYPES = {".html": "text/html", ".js": "text/javascript", ".mjs": "text/javascript", ".css": "text/css"}


class ThrottledServer(ThreadingHTTPServer):
    """Serves the viewer, and `files` by name, on 127.0.0.1: a context manager.

    rate: bytes a second of files (None: unlimited); the page is not throttled. ranges: whether byte ranges are
    supported. `log`: [name, first byte, bytes sent] per file response.
    """

    daemon_threads = True
    block_on_close = False
    packet = 1460  # bytes that are sent at once

    def __init__(self, files: dict[str, bytes], rate: float | None = None, ranges: bool = True):
        super().__init__(("127.0.0.1", 0), _Handler)
        self.files, self.rate, self.ranges = files, rate, ranges
        self.log: list[list] = []
        self._free_at, self._lock = 0.0, threading.Lock()

    def __enter__(self) -> ThrottledServer:
        threading.Thread(target=self.serve_forever, args=(0.02,), daemon=True).start()
        return self

    def __exit__(self, *_) -> None:
        self.shutdown()
        self.server_close()

    def handle_error(self, request, client_address) -> None:
        """Ignore errors: browsers close connections at any time."""

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}/"

    def page(self, name: str | None = None, **more: str) -> str:
        """Return the viewer's address with a file, which it shows without the story of its first seconds."""
        query = ([f"file=/{name}"] if name else []) + [
            f"{key}={value}" for key, value in ({"intro": "off"} | more).items()
        ]
        return self.address + ("?" + "&".join(query) if query else "")

    def sent(self, name: str) -> int:
        return sum(size for file, _, size in self.log if file == name)

    def wait(self, size: int) -> None:
        """Sleep until `size` more bytes may be sent."""
        if self.rate is None:
            return
        with self._lock:
            self._free_at = max(self._free_at, time.monotonic()) + size / self.rate
            until = self._free_at
        time.sleep(max(0.0, until - time.monotonic()))


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True  # it would delay the end of a response by 40 ms
    server: ThrottledServer

    def do_GET(self) -> None:
        """Answer a request with a file in memory at the limited rate, with a file of the viewer's page at once, or with
        status 404.
        """
        name = unquote(self.path.split("?")[0]).lstrip("/") or "index.html"
        if name in self.server.files:
            self._file(name, self.server.files[name])
        elif (WEB / name).is_file():
            self._respond(200, (WEB / name).read_bytes(), {"Content-Type": TYPES.get(Path(name).suffix, "text/plain")})
        else:
            self._respond(404, b"", {})

    def _file(self, name: str, data: bytes) -> None:
        """Send a file of `data`, or the range of bytes that the request names, at the limited rate, and log the name,
        the first byte and the number of bytes sent.
        """
        requested = re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers.get("Range", "")) if self.server.ranges else None
        first, last = (int(requested[1]), min(int(requested[2]), len(data) - 1)) if requested else (0, len(data) - 1)
        entry = [name, first, 0]
        self.server.log.append(entry)
        if first >= len(data):
            self._respond(416, b"", {"Content-Range": f"bytes */{len(data)}"})
            return
        headers = {"Content-Type": TYPES.get(Path(name).suffix, "application/octet-stream"), "ETag": f'"{len(data)}"'}
        if requested:
            headers["Content-Range"] = f"bytes {first}-{last}/{len(data)}"
        self._respond(206 if requested else 200, data[first : last + 1], headers, entry)

    def _respond(self, status: int, body: bytes, headers: dict[str, str], entry: list | None = None) -> None:
        """Send a status, headers and a body. With `entry`, an item of the log, the body is sent at the limited rate,
        and the item's last number counts the bytes sent.
        """
        self.send_response(status)
        for name, value in (headers | {"Content-Length": str(len(body))}).items():
            self.send_header(name, value)
        self.end_headers()
        try:
            if entry is None:
                self.wfile.write(body)
            for at in range(0, len(body) if entry else 0, self.server.packet):
                packet = body[at : at + self.server.packet]
                self.server.wait(len(packet))
                entry[2] += len(packet)  # before the client can have it, and ask
                self.wfile.write(packet)
        except ConnectionError:
            self.close_connection = True

    def log_message(self, *_) -> None:
        pass
