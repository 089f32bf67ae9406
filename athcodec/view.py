"""The viewer in a browser: a local server for one file, and pages that carry a file inside.

`athcodec/viewer/web` holds the page as it is served anywhere; nothing is made here but what joins it with a file. The
server answers on 127.0.0.1 only, and to nobody but who has the address. Remote files are passed on range by range.
"""

from __future__ import annotations

import base64
import html
import io
import json
import os
import re
import secrets
import webbrowser
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from urllib.parse import quote, urlsplit

from athcodec.atomic_files import is_url, new_file
from athcodec.decoder import open as open_ath
from athcodec.errors import AthError, MissingExtra

WEB = Path(__file__).parent / "viewer" / "web"
PAGE = WEB / "index.html"
INSTALL = 'pip install "athcodec[view]"'
PASSED_ON = ("Content-Length", "Content-Range", "Content-Type", "ETag", "Last-Modified", "Accept-Ranges")

_MAP = re.compile(r'<script type="importmap">(.*?)</script>', re.DOTALL)
_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' data:; style-src 'unsafe-inline'; "
    "img-src data: blob:; worker-src blob:; connect-src 'none'; base-uri 'none'; form-action 'none'"
)


def export_page(path: str | os.PathLike[str], page: str | os.PathLike[str], clip: str | None = None) -> int:
    """Writes one page that plays an .ath file without any other file or server.

    Parameters
    ----------
    path : str or path-like
        The .ath file, or its URL.
    page : str or path-like
        The HTML file to write; it appears when it is complete.
    clip : str, optional
        The name of the clip to begin with; by default the first.

    Returns
    -------
    int
        Size of the page, bytes.

    Raises
    ------
    AthError
        Where `path` is no .ath file, or has no such clip.
    OSError
        Where a file cannot be read or written.
    """
    data = _read(path)
    with open_ath(io.BytesIO(data), clip=clip):
        pass
    text = self_contained(data, file_name(path), clip).encode()
    with new_file(page) as out:
        out.write(text)
    return len(text)


def _read(path: str | os.PathLike[str]) -> bytes:
    if not is_url(path):
        return Path(path).read_bytes()
    from athcodec.remote import Remote  # what it needs takes long to import

    with Remote(path) as file:
        return file.read()


def self_contained(data: bytes, name: str, clip: str | None = None) -> str:
    """The page with everything inside: styles, modules as data URLs, the worker and the file as text."""
    text = PAGE.read_text("utf-8")
    modules = json.loads(_MAP.search(text)[1])["imports"]
    inside = json.dumps({"imports": {name: _data_url(WEB / file) for name, file in modules.items()}})
    main = _script((WEB / "viewer.js").read_text("utf-8"))
    worker = _script((WEB / "ath_worker.js").read_text("utf-8"))
    first = "" if clip is None else f' data-clip="{html.escape(clip)}"'
    file = (
        f'<script type="text/plain" id="ath-file" data-name="{html.escape(name)}"{first}>'
        f"{base64.b64encode(data).decode()}</script>"
    )
    for old, new in (
        (r'content="default-src[^"]*"', f'content="{_POLICY}"'),
        (r'<link rel="modulepreload"[^>]*>\n', ""),
        (r'<link rel="stylesheet"[^>]*>', f"<style>{(WEB / 'viewer.css').read_text('utf-8')}</style>"),
        (_MAP.pattern, f'<script type="importmap">{inside}</script>'),
        (r'<script type="module" src="viewer.js"></script>', ""),
        (
            r"</body>",
            f'<script type="text/plain" id="ath-worker">{worker}</script>\n{file}\n'
            f'<script type="module">{main}</script>\n</body>',
        ),
    ):
        text = re.sub(old, lambda _, new=new: new, text, flags=re.DOTALL)
    return text


def _data_url(path: Path) -> str:
    return f"data:text/javascript;base64,{base64.b64encode(path.read_bytes()).decode()}"


def _script(text: str) -> str:
    """Text that cannot end the script element that it is put into."""
    return text.replace("</script", "<\\/script").replace("<!--", "<\\!--")


def file_name(path: str | os.PathLike[str]) -> str:
    path = urlsplit(os.fspath(path)).path if is_url(path) else os.fspath(path)
    return path.replace("\\", "/").rstrip("/").rpartition("/")[2] or "file.ath"


def serve(
    path: str | os.PathLike[str], port: int = 0, ready: Callable[[str], None] = print, clip: str | None = None
) -> None:
    """Serves the viewer with an .ath file on 127.0.0.1 until it is interrupted.

    Parameters
    ----------
    path : str or path-like
        The .ath file, or its URL.
    port : int
        0: a free one.
    ready : callable
        Called with the page's address when it can be opened.
    clip : str, optional
        The name of the clip to begin with; by default the first.

    Raises
    ------
    MissingExtra
        Where aiohttp is not installed.
    AthError, OSError
        As `export_page`.
    """
    _check(path, clip)
    import asyncio

    from aiohttp import web

    async def run() -> None:
        place = f"file/{secrets.token_urlsafe(12)}/{file_name(path)}"
        runner = web.AppRunner(application(path, place), access_log=None)
        await runner.setup()
        try:
            site = web.TCPSite(runner, "127.0.0.1", port)
            await site.start()
            address = f"http://127.0.0.1:{site._server.sockets[0].getsockname()[1]}"
            ready(f"{address}/?file={quote(place)}" + ("" if clip is None else f"&clip={quote(clip, safe='')}"))
            await asyncio.Event().wait()
        finally:
            await runner.cleanup()

    asyncio.run(run())


def _check(path: str | os.PathLike[str], clip: str | None) -> None:
    try:
        import aiohttp  # noqa: F401
    except ImportError:
        raise MissingExtra(f"athcodec view: needs aiohttp: {INSTALL}; --export PAGE works without") from None
    _refuse_other_urls(path)
    with open_ath(path, clip=clip):
        pass


def _refuse_other_urls(path: str | os.PathLike[str]) -> None:
    """The server passes on what http and https have; for others there is --export."""
    if is_url(path) and urlsplit(path).scheme.lower() not in ("http", "https"):
        scheme = urlsplit(path).scheme
        raise AthError(f"{path}: got {scheme}://, expected http:// or https://; --export PAGE reads others")


def application(path: str | os.PathLike[str], place: str):
    """The aiohttp application: the page, and the file at `place`, which only the page's address tells."""
    from aiohttp import ClientSession, web

    async def page(request):
        return web.FileResponse(PAGE)

    async def local(request):
        return web.FileResponse(path, headers={"Content-Type": "application/octet-stream", "Cache-Control": "no-cache"})

    async def remote(request):
        asked = {name: request.headers[name] for name in ("Range",) if name in request.headers}
        async with request.app[session].get(os.fspath(path), headers=asked) as answer:
            passed = {name: answer.headers[name] for name in PASSED_ON if name in answer.headers}
            response = web.StreamResponse(status=answer.status, headers=passed)
            await response.prepare(request)
            async for piece in answer.content.iter_any():
                await response.write(piece)
            return response

    async def client(app):
        app[session] = ClientSession(auto_decompress=False, headers={"Accept-Encoding": "identity"})
        yield
        await app[session].close()

    session = web.AppKey("session", ClientSession)
    app = web.Application()
    app.router.add_get("/", page)
    if is_url(path):
        app.cleanup_ctx.append(client)
    app.router.add_get(f"/{quote(place)}", remote if is_url(path) else local)
    app.router.add_static("/", WEB)
    return app


def open_browser(address: str) -> None:
    """Opens the page where there is a browser; where there is none, its address has been printed."""
    with suppress(webbrowser.Error):
        webbrowser.open(address)
