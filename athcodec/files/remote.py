"""Files behind a URL, read in few requests: http and https with byte ranges, and whatever else fsspec knows.

A `Remote` is a file object for decoder.open. It reads ahead at the front, so that header and prelude arrive
together, and learns which ranges come next (`prefetch`), so that a run of chunks is one request. It asks
again a few times where a server drops the connection, stalls or is overloaded, and raises RemoteError, in one
line, where that does not help, where the file is no longer the one that was opened, and where a server that
ignores ranges has a large one. It knows nothing of what the bytes mean: checksums are the container's
business.
"""

from __future__ import annotations

import asyncio
import ipaddress
import os
import re
from collections import OrderedDict
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar
from urllib.parse import urljoin, urlsplit

from athcodec.errors import RemoteError
from athcodec.files.shown import redacted, without_secrets
from athcodec.untyped import FsspecObject, JsonObject

if TYPE_CHECKING:
    import aiohttp

READ_AHEAD = 64 << 10
GAP = 16 << 10  # Unwanted bytes that cost less than another request.
KEPT_BYTES = 64 << 20  # Bytes that are kept; a server without ranges may send a file of this size.
AT_ONCE = 8  # Requests at the same time.
SLOWEST = 4096  # Bytes a second; a slower request has stalled.
FIRST_PAUSE = 0.1  # Seconds before a request is repeated; each further wait is four times as long.
INSTALL = 'pip install "athcodec[remote]"'

_RANGE = re.compile(r"bytes (\d+)-(\d+)/(\d+)")

Answer = TypeVar("Answer")
Range = tuple[int, int]
"""Offset and size."""


class Remote:
    """A seekable binary file behind a URL.

    Parameters
    ----------
    url : str
        http://, https://, or whatever else fsspec knows.
    timeout : float
        Seconds without a byte until a request counts as failed.
    retries : int
        How often a failed request is made again.
    **options
        For fsspec's file system, such as headers=... and client_kwargs=... for HTTP.

    Attributes
    ----------
    requests, bytes : int
        What was asked of the server, and what came.
    size : int
        Length of the file, bytes.

    Raises
    ------
    RemoteError
        If the bytes cannot be had, or are no longer those of the file that was opened.
    """

    def __init__(self, url: str, *, timeout: float = 30.0, retries: int = 3, **options: Any):
        self.url, self.timeout, self.retries = url, timeout, retries
        self.requests = self.bytes = 0
        self._place = 0
        self._kept: OrderedDict[int, bytes] = OrderedDict()  # Bytes by their offset.
        self._source = _source(self, options)
        self.size = self._source.size()

    @property
    def change_hint(self) -> str:
        """Return other causes of a wrong checksum than damage, as the end of an error message."""
        return self._source.change_hint

    def prefetch(self, ranges: list[Range]) -> None:
        """Fetch what is missing of these ascending ranges, if it can be kept until it is read: one request for each,
        and for those that are close together."""
        wanted = _joined([self._missing(offset, min(size, self.size - offset)) for offset, size in ranges])
        if sum(size for _, size in wanted) <= KEPT_BYTES:
            self.keep(self._source.fetch(wanted))

    def keep(self, pieces: list[tuple[int, bytes]]) -> None:
        """Store pieces of the file, (offset, bytes), and drop the oldest beyond KEPT_BYTES."""
        for offset, data in pieces:
            if len(data) > len(self._kept.get(offset, b"")):
                self._kept[offset] = data
                self._kept.move_to_end(offset)
        while len(self._kept) > 1 and sum(map(len, self._kept.values())) > KEPT_BYTES:
            self._kept.popitem(last=False)

    def _at(self, offset: int) -> bytes | memoryview:
        """Return the kept bytes from `offset` on; empty if there are none."""
        best = memoryview(b"")
        for start, data in self._kept.items():
            if start <= offset < start + len(data) and start + len(data) - offset > len(best):
                best = memoryview(data)[offset - start :]
        return best

    def _missing(self, offset: int, size: int) -> Range:
        """Return what is left of a range without its kept beginning."""
        while size > 0 and (there := len(self._at(offset))):
            offset, size = offset + there, size - there
        return offset, max(size, 0)

    # ---- as a file ----

    def read(self, size: int = -1) -> bytes:
        """Return the next `size` bytes of the file, or all that follow. Bytes that are not in memory yet are
        fetched."""
        stop = self.size if size < 0 else min(self._place + size, self.size)
        parts = []
        while self._place < stop:
            there = self._at(self._place)[: stop - self._place]
            if not there:
                ahead = min(max(stop - self._place, READ_AHEAD), self.size - self._place)
                self.keep(self._source.fetch([(self._place, ahead)]))
                there = self._at(self._place)[: stop - self._place]
            parts.append(there)
            self._place += len(there)
        return b"".join(parts)

    def seek(self, place: int, whence: int = os.SEEK_SET) -> int:
        self._place = place + {os.SEEK_SET: 0, os.SEEK_CUR: self._place, os.SEEK_END: self.size}[whence]
        return self._place

    def tell(self) -> int:
        return self._place

    def close(self) -> None:
        self._kept.clear()
        self._source.close()

    def __enter__(self) -> Remote:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _joined(ranges: list[Range]) -> list[Range]:
    """Return ascending ranges (offset, size) without empty ones. Ranges that are at most GAP bytes apart are merged
    into one."""
    joined: list[Range] = []
    for offset, size in ranges:
        if joined and size and offset - sum(joined[-1]) <= GAP:
            joined[-1] = joined[-1][0], offset + size - joined[-1][0]
        elif size:
            joined.append((offset, size))
    return joined


def _source(remote: Remote, options: JsonObject) -> _Http | _AnySystem:
    """Return what fetches the bytes of a URL: HTTP with checks of the server's answers, or another file system of
    fsspec. Raises RemoteError if a package is missing."""
    shown = without_secrets(remote.url)
    try:
        import fsspec

        http = urlsplit(remote.url).scheme.lower() in ("http", "https")
        if http:
            import aiohttp  # noqa: F401

            options = guarded(remote.url, options)
        system, path = fsspec.core.url_to_fs(remote.url, **({"skip_instance_cache": True} | options))
    except ImportError as error:
        missing = getattr(error, "name", None)
        if missing in ("fsspec", "aiohttp"):
            raise RemoteError(f"{shown}: reading a URL needs {missing}: {INSTALL}") from error
        raise RemoteError(f"{shown}: {_one_line(error)}") from error
    except ValueError as error:
        raise RemoteError(f"{shown}: {_one_line(error)}") from error
    return _Http(remote, system, shown) if http else _AnySystem(remote, system, path, shown)


def guarded(url: str, options: JsonObject) -> JsonObject:
    """Return `options` for fsspec's HTTP file system, extended so that a redirect from a public address to a private
    one raises RemoteError. A server could otherwise reach machines in the user's own network."""
    import aiohttp

    first = urlsplit(url).hostname or ""

    async def check(
        session: aiohttp.ClientSession, context: object, params: aiohttp.TraceRequestRedirectParams
    ) -> None:
        place = params.response.headers.get("Location") or params.response.headers.get("URI") or ""
        target = urlsplit(urljoin(str(params.response.url), place)).hostname or ""
        if await is_private(target) and not await is_private(first):
            raise RemoteError(f"{without_secrets(url)}: got a redirect to {target[:80]!r}, expected a public address")

    trace = aiohttp.TraceConfig()
    trace.on_request_redirect.append(check)
    origin = options.get("client_kwargs") or {}
    return options | {"client_kwargs": origin | {"trace_configs": [*origin.get("trace_configs", ()), trace]}}


async def is_private(host: str) -> bool:
    """Return whether a name leads to an address of this machine, a private network or a link."""
    try:
        addresses = await asyncio.get_running_loop().getaddrinfo(host, None)
    except (OSError, UnicodeError):
        return False  # A name without an address leads nowhere.
    return any(not ipaddress.ip_address(str(address[0]).partition("%")[0]).is_global for *_, address in addresses)


def _one_line(error: BaseException) -> str:
    return " ".join(redacted(str(error)).split()) or type(error).__name__


class _AnySystem:
    """Any fsspec file system. Only checksums tell that a file has changed."""

    change_hint = ", or the file has been changed since it was opened"

    def __init__(self, remote: Remote, system: FsspecObject, path: str, shown: str):
        self._remote, self._system, self._path, self._shown = remote, system, path, shown

    def size(self) -> int:
        size = self._try(lambda: self._system.info(self._path)["size"])
        if size is None:
            raise RemoteError(f"{self._shown}: got no length, expected a file that has one")
        return size

    def fetch(self, ranges: list[Range]) -> list[tuple[int, bytes]]:
        """Return (offset, bytes) of each range (offset, size), fetched at once if the file system can. Raises
        RemoteError."""
        if not ranges:
            return []
        starts, stops = [offset for offset, _ in ranges], [offset + size for offset, size in ranges]
        parts = self._try(
            lambda: self._system.cat_ranges([self._path] * len(ranges), starts, stops, on_error="raise"), len(ranges)
        )
        for (offset, size), data in zip(ranges, parts, strict=True):
            self._remote.bytes += len(data)
            if len(data) != size:
                raise RemoteError(
                    f"{self._shown}: got {len(data)} bytes from {offset} on, expected {size}{self.change_hint}"
                )
        return list(zip(starts, parts))

    def _try(self, ask: Callable[[], Answer], requests: int = 1) -> Answer:
        self._remote.requests += requests
        try:
            return ask()
        except Exception as error:  # Each file system has errors of its own kind.
            raise RemoteError(f"{self._shown}: {type(error).__name__}: {_one_line(error)}") from error

    def close(self) -> None:
        pass


class _Again(Exception):
    """A request failed in a way that may pass."""


class _Http:
    """Byte ranges over HTTP, on the session of fsspec's file system."""

    def __init__(self, remote: Remote, system: FsspecObject, shown: str):
        self._remote, self._system, self._shown = remote, system, shown
        self._length: int | None = None
        self._tags: dict[str, str] = {}

    @property
    def change_hint(self) -> str:
        return "" if self._tags else ", or the file has been changed on the server, which says nothing of that"

    def size(self) -> int:
        """Return the length of the file in bytes, and keep its first bytes, which the same request fetches."""
        try:
            self._remote.keep(self.fetch([(0, READ_AHEAD)]))
        except BaseException:
            self.close()
            raise
        assert self._length is not None  # The first answer has set it.
        return self._length

    def fetch(self, ranges: list[Range]) -> list[tuple[int, bytes]]:
        from fsspec.asyn import sync

        return sync(self._system.loop, self._fetch_all, ranges) if ranges else []

    async def _fetch_all(self, ranges: list[Range]) -> list[tuple[int, bytes]]:
        """Return (offset, bytes) of all ranges (offset, size), with up to AT_ONCE requests at a time."""
        slots = asyncio.Semaphore(AT_ONCE)

        async def one(offset: int, size: int) -> tuple[int, bytes]:
            async with slots:
                return await self._fetch(offset, size)

        tasks = [asyncio.ensure_future(one(*wanted)) for wanted in ranges]
        try:
            return await asyncio.gather(*tasks)
        finally:
            for task in tasks:
                task.cancel()

    async def _fetch(self, offset: int, size: int) -> tuple[int, bytes]:
        """Return (offset, bytes) of one range, or (0, the whole file) if the server ignores ranges. Failures that may
        pass are tried again. Raises RemoteError."""
        for attempt in range(self._remote.retries + 1):
            try:
                return await self._ask(offset, size)
            except _Again as error:
                reason = _one_line(error)
            if attempt < self._remote.retries:
                await asyncio.sleep(FIRST_PAUSE * 4**attempt)
        raise self._refusal(f"{reason}; tried {self._remote.retries + 1} times")

    async def _ask(self, offset: int, size: int) -> tuple[int, bytes]:
        """Send one request for a range and return (offset, bytes) as `_fetch` does. Raises _Again for a failure that
        may pass, RemoteError for any other."""
        import aiohttp

        options = dict(self._system.kwargs)
        headers = {
            **options.pop("headers", {}),
            "Range": f"bytes={offset}-{offset + size - 1}",
            "Accept-Encoding": "identity",
        }
        patience = self._remote.timeout
        options["timeout"] = aiohttp.ClientTimeout(
            total=patience + size / SLOWEST, sock_connect=patience, sock_read=patience
        )
        session = await self._system.set_session()
        self._remote.requests += 1
        try:
            async with session.get(self._system.encode_url(self._remote.url), headers=headers, **options) as answer:
                self._remote.requests += len(answer.history)
                return await self._answered(answer, offset, size)
        except (aiohttp.InvalidURL, aiohttp.TooManyRedirects) as error:
            raise self._refusal(f"{type(error).__name__}: {without_secrets(self._remote.url)}") from error
        except TimeoutError:
            raise _Again(f"no answer, or not all of it, within {patience:g} seconds") from None
        except (aiohttp.ClientError, ConnectionError) as error:
            raise _Again(f"the connection failed ({type(error).__name__}: {_one_line(error)})") from error

    async def _answered(self, answer: aiohttp.ClientResponse, offset: int, size: int) -> tuple[int, bytes]:
        """Return (offset, bytes) from the server's answer to the request for a range. Raises _Again, RemoteError."""
        if answer.status == 206:
            return offset, await self._part(answer, offset, size)
        if answer.status == 200:
            return 0, await self._whole(answer)
        if answer.status == 416:
            return 0, self._nothing(answer)
        if answer.status >= 500 or answer.status in (408, 425, 429):
            raise _Again(f"the server answers {answer.status} {answer.reason}")
        raise self._refusal(f"the server answers {answer.status} {answer.reason}")

    async def _part(self, answer: aiohttp.ClientResponse, offset: int, size: int) -> bytes:
        """Return the bytes of an answer that holds just the range that was asked for. Raises RemoteError if it holds
        another."""
        content_range = answer.headers.get("Content-Range", "nothing")
        match = _RANGE.fullmatch(content_range)
        if match is None or answer.headers.get("Content-Encoding", "identity") != "identity":
            raise self._refusal(
                f"got Content-Range {content_range!r}, Content-Encoding "
                f"{answer.headers.get('Content-Encoding')!r}; expected bytes as they are, of a known "
                "length"
            )
        first, last, length = map(int, match.groups())
        self._check_same(length, answer.headers)
        if (first, last + 1) != (offset, min(offset + size, length)):
            raise self._refusal(f"got bytes {first} to {last}, expected {offset} to {min(offset + size, length) - 1}")
        return await self._body(answer, last + 1 - first)

    async def _whole(self, answer: aiohttp.ClientResponse) -> bytes:
        """Return the whole file from the answer of a server that ignores ranges. Raises RemoteError if the file is too
        large to be kept in memory."""
        length = None if "Content-Encoding" in answer.headers else answer.content_length
        if length is not None and length > KEPT_BYTES:
            raise self._refusal(
                f"the server ignores byte ranges and the file has {length} bytes; expected ranges, or "
                f"at most {KEPT_BYTES} bytes"
            )
        data = await self._body(answer, length)
        self._check_same(len(data), answer.headers)
        return data

    def _nothing(self, answer: aiohttp.ClientResponse) -> bytes:
        """Raise for a range that begins behind the end, of an empty file or of one that has become shorter."""
        length = int(re.sub(r"\D", "", answer.headers.get("Content-Range", "")) or 0)
        if self._length is None and length > 0:
            raise self._refusal("the server answers 416 to a range that the file has")
        self._check_same(length, answer.headers)
        return b""

    async def _body(self, answer: aiohttp.ClientResponse, expected: int | None) -> bytes:
        """Return the bytes of an answer. Raises _Again if fewer than `expected` arrive, RemoteError if more do."""
        most = KEPT_BYTES if expected is None else expected
        data = bytearray()
        async for piece in answer.content.iter_chunked(1 << 16):
            data += piece
            self._remote.bytes += len(piece)
            if len(data) > most:
                raise self._refusal(f"the server sends more than {most} bytes; expected no more")
        if expected is not None and len(data) < expected:
            raise _Again(f"the connection ended after {len(data)} of {expected} bytes")
        return bytes(data)

    def _check_same(self, length: int, headers: Mapping[str, str]) -> None:
        """Raise RemoteError if length, ETag or Last-Modified of an answer show that the file has changed since it was
        opened."""
        tags = {name: headers[name] for name in ("ETag", "Last-Modified") if name in headers}
        if self._length is None:
            self._length, self._tags = length, tags
        pairs: list[tuple[str, object, object]] = [("a length", length, self._length)]
        pairs += [(name, tags[name], self._tags[name]) for name in tags if name in self._tags]
        for name, got, expected in pairs:
            if got != expected:
                raise self._refusal(
                    f"the file was changed on the server since it was opened: got {name} of {got}, "
                    f"expected {expected}; open it again"
                )

    def _refusal(self, reason: str) -> RemoteError:
        return RemoteError(f"{self._shown}: {reason}")

    def close(self) -> None:
        session = self._system._session
        if session is not None:
            self._system.close_session(self._system.loop, session)
