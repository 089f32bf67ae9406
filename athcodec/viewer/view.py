"""The viewer in a browser: a local server for one file, and pages that carry a file inside.

`athcodec/viewer/web` holds the page as it is served anywhere; nothing is made here but what joins it with a file. The
server answers on 127.0.0.1 only, and to nobody but who has the address. Remote files are passed on range by range.
"""

from __future__ import annotations

import base64
import gzip
import html
import io
import json
import os
import re
import secrets
import webbrowser
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, urlsplit

from athcodec.decoding.decoder import Decoder
from athcodec.decoding.host_mesh import HostMesh
from athcodec.errors import AthError, ClipError, MissingExtra
from athcodec.files.atomic import check_target, file_ids, is_url, keeping, new_file
from athcodec.files.plain import FilePath
from athcodec.opening import open as open_ath
from athcodec.viewer.still import still_svg

if TYPE_CHECKING:
    from aiohttp import web

    Answer = Callable[[web.Request], Awaitable[web.StreamResponse]]

WEB = Path(__file__).parent / "web"
PAGE = WEB / "index.html"
INSTALL = 'pip install "athcodec[view]"'
Floor = Mapping[FilePath, float]
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".txt": "text/plain; charset=utf-8",
}
"""Of the page's files, by suffix."""
PASSED_ON = ("Content-Length", "Content-Range", "Content-Type", "ETag", "Last-Modified", "Accept-Ranges")

_BESIDE = re.compile(r'(from|import\()"\./(three|viewer|later|model)\.js"')
"""Modules that the page's own names as files beside it."""
_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' data:; style-src 'unsafe-inline'; "
    "img-src data: blob:; worker-src blob:; connect-src 'none'; base-uri 'none'; form-action 'none'"
)


def export_page(
    path: FilePath,
    page: FilePath,
    clip: str | None = None,
    host_mesh: HostMesh | None = None,
    floor: Floor | None = None,
) -> int:
    """Write one page that plays an .ath file without any other file or server.

    Parameters
    ----------
    path : str or path-like
        The .ath file, or its URL.
    page : str or path-like
        The HTML file to write; it appears when it is complete. An older page is replaced, no other file.
    clip : str, optional
        The name of the clip to begin with; by default the first.
    host_mesh : array, MotionClip, str or path-like, optional
        The mesh that is the rest pose, for a file that does not hold one: see AthFile.set_host_mesh.
    floor : mapping of str or path-like to float, optional
        Files of plants for the floor of the page's forest, and how many of each stand around a tree.

    Returns
    -------
    int
        Size of the page, bytes.

    Raises
    ------
    AthError
        Where `path` is no .ath file, has no such clip, or needs another mesh.
    OSError
        Where a file cannot be read or written.
    """
    mesh_file = host_mesh if isinstance(host_mesh, (str, os.PathLike)) else None
    with keeping(file_ids(path, mesh_file, *(floor or ()))):
        check_target(page, ".html")
        data = _read(path)
        is_glb = _is_glb(data)
        mesh, still = _checked(path if is_glb else io.BytesIO(data), clip, host_mesh, is_glb)
        text = self_contained(data, file_name(path), clip, mesh, _read_floor(floor), still).encode()
        with new_file(page) as out:
            out.write(text)
    return len(text)


def _read_floor(floor: Floor | None) -> list[tuple[bytes, float]]:
    files = [(_read(path), each) for path, each in (floor or {}).items()]
    for data, _ in files:
        refuse_glb(data)
        _checked(io.BytesIO(data), None, None)
    return files


def _checked(
    path: Any, clip: str | None, host_mesh: HostMesh | None, has_mesh: bool = False
) -> tuple[bytes | None, str]:
    """Open the file as the page will; gives the host's mesh as the page takes it, float32, for a file that needs one
    and is not in a GLB that has it, and a still picture. Raises AthError, OSError."""
    with open_ath(path, clip=clip, host_mesh=host_mesh) as decoder:
        return None if has_mesh else _mesh_of(decoder), still_svg(decoder)


def _mesh_of(decoder: Decoder) -> bytes | None:
    return None if decoder.file.host_checksum is None else decoder.level_rest(0).astype("<f4").tobytes()


def page_of(decoder: Decoder) -> str:
    """Return the page of an open file, which begins with the decoder's clip. Raises AthError, OSError."""
    file = decoder.file
    clip = decoder.clip.name or None
    return self_contained(file.whole(), file_name(file.name), clip, _mesh_of(decoder), still=still_svg(decoder))


def _is_glb(data: bytes) -> bool:
    return data[:4] == b"glTF"


def refuse_glb(data: bytes) -> None:
    if _is_glb(data):
        raise ClipError(
            "got a GLB, expected an .ath file: athcodec view FILE.glb shows it alone; decode to .npz and encode make "
            "an .ath file of it"
        )


def _read(path: FilePath) -> bytes:
    """Return the bytes of a file or a URL."""
    if not is_url(path):
        return Path(path).read_bytes()
    from athcodec.files.remote import Remote  # Its requirements take long to import.

    with Remote(path) as file:
        return file.read()


def self_contained(
    data: bytes,
    name: str,
    clip: str | None = None,
    mesh: bytes | None = None,
    floor: Sequence[tuple[bytes, float]] = (),
    still: str = "",
) -> str:
    """Return an HTML page with everything inside: styles, modules as data URLs, the worker, and the .ath file `data` as
    text. `still` is an SVG element for browsers that run no scripts.
    """
    text = PAGE.read_text("utf-8")
    modules = ["three", "viewer", "later", *(["model"] if _is_glb(data) else [])]
    inside = json.dumps({"imports": {name: _data_url(_module(f"{name}.js")) for name in modules}})
    worker = _script((WEB / "ath_worker.js").read_text("utf-8"))
    first = "" if clip is None else f' data-clip="{html.escape(clip)}"'
    file = (
        f'<script type="text/plain" id="ath-file" data-name="{html.escape(name)}"{first}>'
        f"{base64.b64encode(data).decode()}</script>"
    )
    if mesh is not None:
        file += f'\n<script type="text/plain" id="ath-mesh">{base64.b64encode(mesh).decode()}</script>'
    for plant, each in floor:
        plain = base64.b64encode(plant).decode()
        file += f'\n<script type="text/plain" class="ath-floor" data-each="{each:g}">{plain}</script>'
    for old, new in (
        (r'content="default-src[^"]*"', f'content="{_POLICY}"'),
        (r'<link rel="modulepreload"[^>]*>\n', ""),
        (r'<script src="start.js"></script>\n', f'<script type="importmap">{inside}</script>\n'),
        (r'<img src="still.svg"[^>]*>', still),
        (r'<link rel="stylesheet"[^>]*>', f"<style>{(WEB / 'viewer.css').read_text('utf-8')}</style>"),
        (r'<script type="module" src="viewer.js"></script>', ""),
        (
            r"</body>",
            f'<script type="text/plain" id="ath-worker">{worker}</script>\n{file}\n'
            '<script type="module">import "viewer";</script>\n</body>',
        ),
    ):
        text = re.sub(old, new.replace("\\", r"\\"), text, flags=re.DOTALL)
    return text


def _module(file: str) -> str:
    """Return the text of a module of the page. It imports other modules by the names in the import map of an exported
    page, not by their files."""
    return _BESIDE.sub(r'\1"\2"', (WEB / file).read_text("utf-8"))


def _data_url(text: str) -> str:
    return f"data:text/javascript;base64,{base64.b64encode(text.encode()).decode()}"


def _script(text: str) -> str:
    """Return text that cannot end the script element that it is put into."""
    return text.replace("</script", "<\\/script").replace("<!--", "<\\!--")


def file_name(path: FilePath) -> str:
    path = urlsplit(os.fspath(path)).path if is_url(path) else os.fspath(path)
    return path.replace("\\", "/").rstrip("/").rpartition("/")[2] or "file.ath"


def serve(
    path: FilePath,
    port: int = 0,
    ready: Callable[[str], None] = print,
    clip: str | None = None,
    host_mesh: HostMesh | None = None,
    *,
    forest: bool = False,
    floor: Floor | None = None,
) -> None:
    """Serve the viewer with an .ath file on 127.0.0.1 until it is interrupted.

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
    host_mesh : array, MotionClip, str or path-like, optional
        As `export_page`.
    forest : bool
        Whether the address is that of the page that shows many plants, on WebGPU.
    floor : mapping, optional
        As `export_page`; files on this computer.

    Raises
    ------
    MissingExtra
        Where aiohttp is not installed.
    AthError, OSError
        As `export_page`.
    """
    _check_server(path)
    is_glb = file_name(path).lower().endswith(".glb")  # The page tells it by the name, too.
    if forest and is_glb:
        raise ClipError("--forest: got a GLB, expected an .ath file")
    mesh, still = _checked(path, clip, host_mesh, is_glb)
    grown = _read_floor(floor)
    import asyncio

    from aiohttp import web

    async def run() -> None:
        """Start the server, call `ready` with the page's address, and serve until interrupted."""
        place = f"file/{secrets.token_urlsafe(12)}/{file_name(path)}"
        beside = {} if mesh is None else {f"{place}.mesh": mesh}
        beside |= {f"{place}.floor{i}": data for i, (data, _) in enumerate(grown)}
        runner = web.AppRunner(application(path, place, beside, still), access_log=None)
        await runner.setup()
        try:
            site = web.TCPSite(runner, "127.0.0.1", port)
            await site.start()
            address = f"http://127.0.0.1:{runner.addresses[0][1]}"
            more = ("" if clip is None else f"&clip={quote(clip, safe='')}") + (
                "" if mesh is None else f"&mesh={quote(place)}.mesh"
            )
            more += "".join(f"&floor={quote(place)}.floor{i}&each={each:g}" for i, (_, each) in enumerate(grown))
            ready(f"{address}/{'forest.html' if forest else ''}?file={quote(place)}{more}")
            await asyncio.Event().wait()
        finally:
            await runner.cleanup()

    asyncio.run(run())


def _check_server(path: FilePath) -> None:
    """Raise MissingExtra if aiohttp is missing, or an error if the path is a URL that the server does not fetch."""
    try:
        import aiohttp  # noqa: F401
    except ImportError:
        raise MissingExtra(f"athcodec view: needs aiohttp: {INSTALL}; --export PAGE works without") from None
    _refuse_other_urls(path)


def _refuse_other_urls(path: FilePath) -> None:
    """Refuse URLs of other kinds than http and https, which the server cannot pass on; for others there is --export."""
    if is_url(path) and urlsplit(path).scheme.lower() not in ("http", "https"):
        scheme = urlsplit(path).scheme
        raise AthError(f"{path}: got {scheme}://, expected http:// or https://; --export PAGE reads others")


def application(
    path: FilePath, place: str, beside: Mapping[str, bytes] | None = None, still: str | None = None
) -> web.Application:
    """Return the aiohttp application: the page, and the .ath file at the secret path `place`, which only the page's
    address contains. `beside` has further files by their paths, such as the host's mesh, and `still` is an SVG of the
    plant for browsers that run no scripts.
    """
    from aiohttp import ClientSession, web

    def part(data: bytes, name: str) -> Answer:
        """Return a handler that answers with `data`, compressed for browsers that accept gzip. `name` tells the type of
        the content.
        """
        packed = gzip.compress(data, mtime=0)

        async def answer(request: web.Request) -> web.StreamResponse:
            takes = "gzip" in request.headers.get("Accept-Encoding", "")
            headers = {"Content-Type": TYPES[Path(name).suffix], "Cache-Control": "no-cache", "Vary": "Accept-Encoding"}
            return web.Response(
                body=packed if takes else data, headers=headers | ({"Content-Encoding": "gzip"} if takes else {})
            )

        return answer

    def at_once(data: bytes) -> Answer:
        async def answer(request: web.Request) -> web.StreamResponse:
            return web.Response(body=data, content_type="application/octet-stream")

        return answer

    async def local(request: web.Request) -> web.StreamResponse:
        return web.FileResponse(path, headers={"Content-Type": "application/octet-stream", "Cache-Control": "no-cache"})

    async def remote(request: web.Request) -> web.StreamResponse:
        """Pass a request for the .ath file on to its URL, with the requested range, and the response back."""
        asked = {name: request.headers[name] for name in ("Range",) if name in request.headers}
        async with request.app[session].get(os.fspath(path), headers=asked) as answer:
            passed = {name: answer.headers[name] for name in PASSED_ON if name in answer.headers}
            response = web.StreamResponse(status=answer.status, headers=passed)
            await response.prepare(request)
            async for piece in answer.content.iter_any():
                await response.write(piece)
            return response

    async def client(app: web.Application) -> AsyncIterator[None]:
        app[session] = ClientSession(auto_decompress=False, headers={"Accept-Encoding": "identity"})
        yield
        await app[session].close()

    session = web.AppKey("session", ClientSession)
    app = web.Application()
    for file in sorted(WEB.iterdir()):
        if file.suffix in TYPES:
            answer = part(still.encode() if still and file.name == "still.svg" else file.read_bytes(), file.name)
            app.router.add_get(f"/{file.name}", answer)
            if file == PAGE:
                app.router.add_get("/", answer)
    if is_url(path):
        app.cleanup_ctx.append(client)
    app.router.add_get(f"/{quote(place)}", remote if is_url(path) else local)
    for name, data in (beside or {}).items():
        app.router.add_get(f"/{quote(name)}", at_once(data))
    return app


def open_browser(address: str) -> None:
    """Open the page where there is a browser; where there is none, its address has been printed."""
    with suppress(webbrowser.Error):
        webbrowser.open(address)
