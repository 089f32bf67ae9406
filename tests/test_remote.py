"""Files behind a URL: few requests, the same bits, and an error of one line where the server fails.

The server is a real one on this machine, with faults that a test switches on.
"""

from __future__ import annotations

import asyncio
import gzip
import itertools
import json
import re
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import fsspec
import numpy as np
import pytest
from files import Parts
from plants import plant

import athcodec
from athcodec import cli
from athcodec.errors import BadChecksum, LevelUnavailable, NotAnAthFile, RemoteError, Truncated
from athcodec.files import remote
from athcodec.files.remote import GAP, READ_AHEAD, Remote

pytestmark = pytest.mark.formats


class Server(ThreadingHTTPServer):
    """Serves `data` under any path, with ranges; `fault` answers a request in its own way, unless it returns False."""

    daemon_threads = True
    block_on_close = False

    def __init__(self, data: bytes):
        super().__init__(("127.0.0.1", 0), Handler)
        self.data, self.tags = data, {"ETag": '"one"', "Last-Modified": "Mon, 01 Jan 2024 00:00:00 GMT"}
        self.ranges: list[tuple[int, int]] = []
        self.fault: Callable[[Handler, int, int], bool | None] = lambda handler, start, stop: False
        self.ending = threading.Event()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}/tree.ath"

    def handle_error(self, *_) -> None:
        pass  # clients that hang up are part of the tests


class Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True

    def do_GET(self) -> None:
        start, stop = map(int, re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers["Range"]).groups())
        self.server.ranges.append((start, stop + 1))
        if self.server.fault(self, start, stop + 1) is False:
            self.send_range(start, min(stop + 1, len(self.server.data)))

    def send_range(self, start: int, stop: int, body: bytes | None = None, **headers: str) -> None:
        """The part, or `body` in its place, under the headers of the part."""
        if start >= len(self.server.data):
            self.send_head(416, {"Content-Range": f"bytes */{len(self.server.data)}", "Content-Length": "0"})
            return
        part = {
            "Content-Range": f"bytes {start}-{stop - 1}/{len(self.server.data)}",
            "Content-Length": str(stop - start),
        }
        self.send_head(206, part | headers)
        self.wfile.write(self.server.data[start:stop] if body is None else body)

    def send_whole(self, body: bytes, **headers: str) -> None:
        self.send_head(200, {"Content-Length": str(len(body))} | {k.replace("_", "-"): v for k, v in headers.items()})
        self.wfile.write(body)

    def send_head(self, status: int, headers: dict[str, str]) -> None:
        self.send_response(status)
        for name, value in (headers | self.server.tags).items():
            self.send_header(name, value)
        self.end_headers()

    def log_message(self, *_) -> None:
        pass


def among(chosen: Callable[[int], bool], fault: Callable) -> Callable:
    """The fault for requests of some numbers, counted from 1."""
    asked = itertools.count(1)
    return lambda handler, start, stop: chosen(next(asked)) and fault(handler, start, stop)


def first(count: int, fault: Callable) -> Callable:
    return among(lambda number: number <= count, fault)


def after(count: int, fault: Callable) -> Callable:
    return among(lambda number: number > count, fault)


def drop(handler: Handler, start: int, stop: int) -> None:
    """Half of the answer, and the connection is gone."""
    stop = min(stop, len(handler.server.data))
    handler.send_range(start, stop, handler.server.data[start : (start + stop) // 2])
    handler.close_connection = True


def hang_up(handler: Handler, start: int, stop: int) -> None:
    handler.close_connection = True


def stall(handler: Handler, start: int, stop: int) -> None:
    handler.server.ending.wait()
    handler.close_connection = True


def overloaded(handler: Handler, start: int, stop: int) -> None:
    handler.send_head(503, {"Content-Length": "0"})


def ignore_ranges(handler: Handler, start: int, stop: int) -> None:
    handler.send_whole(handler.server.data)


def compress(handler: Handler, start: int, stop: int) -> None:
    handler.send_whole(gzip.compress(handler.server.data), Content_Encoding="gzip")


@pytest.fixture(scope="module")
def large():
    """A plant whose file is longer than what is read ahead, its prelude not."""
    return plant(seed=3, branches=40, longest=30, frames=240, rough=0.3)


@pytest.fixture(scope="module")
def large_ath(large, tmp_path_factory):
    path = tmp_path_factory.mktemp("large") / "large.ath"
    tam = athcodec.Thresholds(0, 0, 0, 0)  # with modes, whatever is smaller
    athcodec.encode(large, path, rel_error=1e-4, segment_frames=16, effort="fast", tam=tam, ladder="none")
    assert path.stat().st_size > 4 * READ_AHEAD
    return path


@pytest.fixture
def server(large_ath, monkeypatch):
    monkeypatch.setattr(remote, "FIRST_PAUSE", 0.001)
    with Server(large_ath.read_bytes()) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        yield server
        server.ending.set()
        server.shutdown()
        thread.join()


@pytest.fixture
def local(large_ath):
    with athcodec.open(large_ath) as decoder:
        yield decoder


# ---- few requests ----


def test_opening_a_file_is_one_request(server, local):
    with athcodec.open(server.url) as decoder:
        assert server.ranges == [(0, READ_AHEAD)]
        assert decoder.file.info() == local.file.info() and decoder.metadata == local.metadata
        assert decoder.file.source.requests == 1 and decoder.file.source.bytes == READ_AHEAD


def test_a_long_prelude_takes_a_second_request(server, local, monkeypatch):
    monkeypatch.setattr(remote, "READ_AHEAD", 1000)
    with athcodec.open(server.url) as decoder:
        assert decoder.file.info() == local.file.info()
        prelude = decoder.file.prelude_length
    assert prelude > 2000 and decoder.file.source.requests <= 3
    assert max(stop for _, stop in server.ranges) < prelude + 1000


def runs(decoder: athcodec.Decoder, level: int, first: int, last: int) -> list[tuple[int, int]]:
    """(start, stop) of the chunks that the segments need behind what is read ahead, joined where they are
    close."""
    joined: list[list[int]] = []
    kinds = (16,) if level == decoder.file.full_level_count - 1 else (16, 17)
    for chunk in decoder.file.chunks:
        wanted = chunk.kind in kinds or (chunk.kind == 18 and chunk.level == level)
        if wanted and chunk.is_motion and chunk.level <= level and first <= chunk.segment <= last:
            start, stop = max(chunk.offset, READ_AHEAD), chunk.offset + chunk.length
            if joined and start - joined[-1][1] <= GAP:
                joined[-1][1] = stop
            elif stop > start:
                joined.append([start, stop])
    return [(start, stop) for start, stop in joined]


def test_a_segment_is_one_request_for_each_run_of_its_chunks(server, local):
    level, segment = local.file.level_count - 1, len(local.segments) - 1
    frame = local.segments[segment][0]
    wanted = runs(local, level, segment, segment)
    assert len(wanted) > 1
    with athcodec.open(server.url) as decoder:
        assert np.array_equal(decoder.positions(frame), local.positions(frame))
        assert sorted(server.ranges[1:]) == wanted
        assert decoder.file.source.bytes == READ_AHEAD + sum(stop - start for start, stop in wanted)
        before = decoder.file.source.requests
        decoder.positions(frame + 1)
        decoder.positions(0, 0)
        decoder.positions(frame)
        assert decoder.file.source.requests == before, "what has come is kept"


def test_the_whole_motion_takes_three_requests_at_most(server, local):
    with athcodec.open(server.url) as decoder:
        assert np.array_equal(decoder.positions(), local.positions())
        assert decoder.file.source.requests <= 3, "the front, and runs of chunks with maps of subtrees between them"
    with athcodec.open(server.url) as decoder:
        for (_, block), (_, expected) in zip(decoder.blocks(), local.blocks(), strict=True):
            assert np.array_equal(block, expected)
        assert decoder.file.source.requests <= 3


def test_a_coarse_level_fetches_no_finer_ones(server, local):
    with athcodec.open(server.url) as decoder:
        assert np.array_equal(decoder.positions(level=1), local.positions(level=1))
        assert decoder.file.source.bytes <= max(READ_AHEAD, local.levels[1].bytes)


def test_checking_fetches_every_byte_once(server):
    with athcodec.open(server.url, strict=True) as decoder:
        decoder.file.check()
        assert decoder.file.source.requests == 2 and decoder.file.source.bytes == len(server.data)


def test_what_is_too_much_to_keep_is_fetched_piece_by_piece_and_right(server, local, monkeypatch):
    monkeypatch.setattr(remote, "KEPT_BYTES", READ_AHEAD)
    with athcodec.open(server.url) as decoder:
        decoder.file.check()
        for start, stop in decoder.segments:
            assert np.array_equal(decoder[start:stop], local[start:stop])
        kept = sum(map(len, decoder.file.source._kept.values()))
    assert kept <= 2 * READ_AHEAD


def test_a_short_file_is_one_request_in_all(server, full_ath, full_clip):
    server.data = full_ath.read_bytes()
    metadata = full_clip.metadata | {"hierarchy_thresholds": {"epsilon": 0, "xi": 0, "eta": 0, "lambda": 0}}
    with athcodec.open(server.url) as decoder:
        decoder.file.check()
        assert decoder.metadata == metadata and list(decoder.file.attributes) == list(full_clip.attributes)
        assert decoder.file.source.requests == 1 and decoder.file.source.bytes == len(server.data)


def test_a_prefix_on_a_server_plays_the_levels_that_are_there(server, local):
    server.data = server.data[: local.levels[1].bytes + 10]
    with athcodec.open(server.url) as decoder:
        assert decoder.file.deepest == 1 and not decoder.file.complete
        assert np.array_equal(decoder.positions(), local.positions(level=1))
        with pytest.raises(LevelUnavailable, match="cut off"):
            decoder.positions(level=2)


def test_redirects_are_followed_and_counted(server, local):
    def redirect(handler: Handler, start: int, stop: int) -> bool | None:
        if handler.path.startswith("/moved"):
            return False
        handler.send_head(302, {"Location": "/moved.ath", "Content-Length": "0"})

    server.fault = redirect
    with athcodec.open(server.url) as decoder:
        assert np.array_equal(decoder.positions(), local.positions())
        assert decoder.file.source.requests == len(server.ranges)


def test_a_redirect_from_a_public_address_to_a_private_one_is_refused(server, monkeypatch):
    async def is_private(host: str) -> bool:
        return host == "localhost"  # as if 127.0.0.1 were somewhere in the world

    def redirect(handler: Handler, start: int, stop: int) -> None:
        place = f"http://localhost:{server.server_address[1]}/inside"
        handler.send_head(302, {"Location": place, "Content-Length": "0"})

    server.fault = redirect
    monkeypatch.setattr(remote, "is_private", is_private)
    with pytest.raises(RemoteError, match="got a redirect to 'localhost', expected a public address"):
        athcodec.open(server.url)
    assert len(server.ranges) == 1


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1", "10.1.2.3", "169.254.169.254", "::1", "::ffff:10.0.0.1"])
def test_addresses_of_this_machine_and_of_private_networks_are_known(host):
    assert asyncio.run(remote.is_private(host)) and not asyncio.run(remote.is_private("1.1.1.1"))


def test_several_threads_play_from_one_server(server, local):
    expected = local.positions()
    with athcodec.open(server.url) as decoder:

        def watch(seed: int) -> None:
            for frame in np.random.default_rng(seed).integers(decoder.frame_count, size=20):
                assert np.array_equal(decoder.positions(frame), expected[frame])

        with ThreadPoolExecutor(4) as threads:
            list(threads.map(watch, range(4)))


# ---- servers with faults ----


@pytest.mark.parametrize("fault", [drop, hang_up, overloaded])
def test_a_passing_fault_is_retried_unnoticed(fault, server, local):
    server.fault = first(2, fault)
    with athcodec.open(server.url) as decoder:
        server.fault = first(3, fault)
        assert np.array_equal(decoder.positions(), local.positions())
        assert len(server.ranges) >= 5


@pytest.mark.parametrize(
    "fault, message",
    [(drop, r"connection (failed|ended)"), (hang_up, "the connection failed"), (overloaded, "the server answers 503")],
)
@pytest.mark.parametrize("when", [0, 1])
def test_a_fault_that_stays_is_named_with_the_number_of_tries(fault, message, when, server):
    server.fault = after(when, fault)
    with pytest.raises(RemoteError, match=rf"^{re.escape(server.url)}: .*{message}.*; tried 4 times$"):
        with athcodec.open(server.url) as decoder:
            decoder.positions(decoder.frame_count - 1)


def test_a_server_that_stalls_is_given_up(server, local):
    with Remote(server.url, retries=1) as source, athcodec.open(source) as decoder:
        patience, source.timeout, server.fault = source.timeout, 0.1, stall
        with pytest.raises(RemoteError, match=r"no answer, or not all of it, within 0\.1 seconds; tried 2 times"):
            decoder.positions()
        source.timeout, server.fault = patience, lambda *_: False
        assert np.array_equal(decoder.positions(), local.positions()), "and can be asked again"


def test_a_server_that_sends_a_byte_now_and_then_is_given_up_too(server, monkeypatch):
    def trickle(handler: Handler, start: int, stop: int) -> None:
        handler.send_range(start, stop, b"")
        for byte in handler.server.data[start:stop]:
            handler.server.ending.wait(0.02)
            handler.wfile.write(bytes([byte]))

    server.fault = trickle
    monkeypatch.setattr(remote, "SLOWEST", 1 << 20)
    with pytest.raises(RemoteError, match="no answer, or not all of it"):
        Remote(server.url, timeout=0.2, retries=0)


def test_a_server_without_ranges_sends_the_file_once(server, local):
    server.fault = ignore_ranges
    with athcodec.open(server.url) as decoder:
        assert np.array_equal(decoder.positions(), local.positions())
        decoder.file.check()
        assert decoder.file.source.requests == 1 and decoder.file.source.bytes == len(server.data)


def test_a_large_file_on_a_server_without_ranges_is_refused(server, monkeypatch):
    server.fault = ignore_ranges
    monkeypatch.setattr(remote, "KEPT_BYTES", len(server.data) - 1)
    with pytest.raises(RemoteError, match=f"ignores byte ranges and the file has {len(server.data)} bytes"):
        athcodec.open(server.url)
    del server.tags["ETag"]

    def endless(handler: Handler, start: int, stop: int) -> None:
        handler.send_head(200, {"Connection": "close"})
        handler.wfile.write(server.data)
        handler.close_connection = True

    server.fault = endless
    with pytest.raises(RemoteError, match=f"sends more than {len(server.data) - 1} bytes"):
        athcodec.open(server.url)


def test_a_server_that_compresses_on_the_way_is_understood(server, local):
    server.fault = compress
    with athcodec.open(server.url) as decoder:
        assert np.array_equal(decoder.positions(0), local.positions(0))


@pytest.mark.parametrize(
    "fault, message",
    [
        (lambda h, a, b: h.send_range(a + 1, b), "got bytes 1 to .*, expected 0 to"),
        (lambda h, a, b: h.send_range(a, b, **{"Content-Range": "bytes 0-5/*"}), "got Content-Range 'bytes 0-5/"),
        (lambda h, a, b: h.send_range(a, b, **{"Content-Encoding": "gzip"}), "Content-Encoding 'gzip'"),
        (lambda h, a, b: h.send_head(404, {"Content-Length": "0"}), "answers 404"),
        (lambda h, a, b: h.send_head(403, {"Content-Length": "0"}), "answers 403"),
        (lambda h, a, b: h.send_head(416, {"Content-Length": "0", "Content-Range": "bytes */9"}), "answers 416"),
        (lambda h, a, b: h.send_head(302, {"Location": h.path, "Content-Length": "0"}), "TooManyRedirects"),
    ],
    ids=["other bytes", "no length", "compressed part", "not there", "not allowed", "no such range", "in circles"],
)
def test_an_answer_that_makes_no_sense_is_refused_at_once(fault, message, server):
    server.fault = fault
    with pytest.raises(RemoteError, match=f"^{re.escape(server.url)}: .*{message}"):
        athcodec.open(server.url)
    assert len(server.ranges) == 1 or "Redirects" in message


def test_an_empty_file_and_a_web_page_are_no_ath_files(server):
    for data in (b"", b"<html>Not here, but with code 200</html>"):
        server.data = data
        with pytest.raises(NotAnAthFile):
            athcodec.open(server.url)


# ---- files that change on the server ----


def change_tag(server: Server) -> None:
    server.tags = {"ETag": '"two"'}


def change_time(server: Server) -> None:
    server.tags = {"Last-Modified": "Tue, 02 Jan 2024 00:00:00 GMT"}


def lengthen(server: Server) -> None:
    server.data += b"more"


def shorten(server: Server) -> None:
    server.data = server.data[: READ_AHEAD + 1]


@pytest.mark.parametrize("change", [change_tag, change_time, lengthen, shorten])
def test_a_file_that_changes_between_two_requests_is_refused_and_not_mixed(change, server, local):
    with athcodec.open(server.url) as decoder:
        change(server)
        with pytest.raises(RemoteError, match="was changed on the server since it was opened: got .*; open it again"):
            decoder.positions()
        assert np.array_equal(decoder.positions(0, 0), local.positions(0, 0)), "what had come before stays"


def test_another_file_of_the_same_length_is_met_by_its_checksums(server):
    server.tags = {}
    with athcodec.open(server.url) as decoder:
        half = len(server.data) // 2
        server.data = server.data[:half] + bytes(len(server.data) - half)
        with pytest.raises(BadChecksum, match="or the file has been changed on the server"):
            decoder.positions()


# ---- the command, other systems, what is missing ----


def test_the_command_reads_urls_and_says_what_it_took(server, local, tmp_path, capsys):
    assert cli.main(["info", server.url, "--json", "--stats"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["vertices"] == local.file.vertex_count and json.loads(out)["file"] == server.url
    assert err == f"athcodec: stats: 1 request, {READ_AHEAD:,} bytes fetched of {len(server.data):,}\n"
    assert cli.main(["verify", server.url, "--stats"]) == 0
    assert f"2 requests, {len(server.data):,} bytes" in capsys.readouterr().err
    assert cli.main(["decode", server.url, str(tmp_path / "a.h5"), "--frames", "0:20", "--stats"]) == 0
    assert re.search(r"stats: \d requests", capsys.readouterr().err)
    with athcodec.read_hdf5(tmp_path / "a.h5") as clip:
        assert np.array_equal(clip.block(0, 20), local.positions(slice(0, 20)))


def test_the_command_counts_the_bytes_of_a_plain_file_too(large_ath, capsys):
    assert cli.main(["info", str(large_ath), "--stats"]) == 0
    assert re.fullmatch(r"athcodec: stats: [\d,]+ bytes read of [\d,]+\n", capsys.readouterr().err)


@pytest.mark.parametrize("verb", ["info", "verify", "decode"])
def test_a_failing_server_is_one_line_and_leaves_no_file(verb, server, tmp_path, capsys):
    server.fault = after(1, drop) if verb != "info" else drop
    words = [verb, server.url] + ([str(tmp_path / "a.h5")] if verb == "decode" else [])
    assert cli.main(words) == 1
    assert re.fullmatch(rf"athcodec: error: {re.escape(server.url)}: [^\n]+\n", capsys.readouterr().err)
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(params=["file", "memory", "s3"])
def other_url(request, large_ath):
    """The URL of the large file on another file system than HTTP."""
    if request.param == "file":
        return f"file://{large_ath}"
    if request.param == "s3":
        return request.getfixturevalue("s3").put({"deep/tree.ath": large_ath.read_bytes()}) + "/deep/tree.ath"
    fsspec.filesystem("memory").pipe("/deep/tree.ath", large_ath.read_bytes())
    return "memory://deep/tree.ath"


def test_other_file_systems_of_fsspec_give_the_same_positions(other_url, local):
    with athcodec.open(other_url) as decoder:
        decoder.file.check()
        assert np.array_equal(decoder.positions(), local.positions())
        assert decoder.file.source.requests == 3, "one of them for the length"


def test_the_command_reads_other_systems_and_says_what_it_took(other_url, local, tmp_path, capsys):
    """As few requests as over HTTP, one for each level that serves the one asked for, and one for the length."""
    size, out = local.file.file_length, tmp_path / "a.h5"
    assert cli.main(["info", other_url, "--json", "--stats"]) == 0
    printed, err = capsys.readouterr()
    assert json.loads(printed)["vertices"] == local.file.vertex_count
    assert err == f"athcodec: stats: 2 requests, {READ_AHEAD:,} bytes fetched of {size:,}\n"
    assert cli.main(["verify", other_url, "--stats"]) == 0
    assert f"3 requests, {size:,} bytes" in capsys.readouterr().err
    assert cli.main(["decode", other_url, str(out), "--level", "1", "--frames", "200:210", "--stats"]) == 0
    requests, fetched = re.search(r"stats: (\d) requests, ([\d,]+) bytes", capsys.readouterr().err).groups()
    assert (
        int(requests) <= 1 + local.file.tables.header.stages[1]
        and int(fetched.replace(",", "")) <= READ_AHEAD + local.levels[1].bytes
    )
    with athcodec.read_hdf5(out) as clip:
        assert np.array_equal(clip.block(0, 10), local.positions(slice(200, 210), level=1))


def test_requests_to_an_object_store_are_those_that_it_answers(s3, large_ath, local):
    url = s3.put({"tree.ath": large_ath.read_bytes()}) + "/tree.ath"
    before = len(s3.answers())
    with athcodec.open(url) as decoder:
        assert np.array_equal(decoder.positions(local.frame_count - 1), local.positions(local.frame_count - 1))
        counted = decoder.file.source.requests
    asked = s3.answers()[before:]
    assert len(asked) == counted > 3
    assert asked[0] == "HEAD /plants/tree.ath 200" and set(asked[1:]) == {"GET /plants/tree.ath 206"}


@pytest.mark.parametrize("name", ["none.ath", "none/none.ath"])
def test_what_an_object_store_does_not_have_is_one_line_without_keys(name, s3, capsys):
    url = f"{s3.put({})}/{name}"
    assert cli.main(["info", url]) == 1
    assert re.fullmatch(rf"athcodec: error: {url}: FileNotFoundError[^\n]*\n", err := capsys.readouterr().err)
    assert "hush" not in err


@pytest.mark.parametrize(
    "url, message",
    [("memory://nothing.ath", "memory://nothing.ath: FileNotFoundError"), ("nonsense://a.ath", "Protocol not known")],
)
def test_what_fsspec_refuses_is_one_line(url, message):
    with pytest.raises(RemoteError, match=message) as caught:
        athcodec.open(url)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("module", ["fsspec", "aiohttp"])
def test_without_the_optional_packages_the_message_names_the_command_that_installs_them(module, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, module, None)
    assert cli.main(["info", "https://example.org/tree.ath"]) == 1
    assert capsys.readouterr().err == (
        f'athcodec: error: https://example.org/tree.ath: reading a URL needs {module}: pip install "athcodec[remote]"\n'
    )


def test_a_local_file_is_opened_without_fsspec_and_aiohttp():
    code = (
        "import sys; sys.modules['fsspec'] = sys.modules['aiohttp'] = None\n"
        "import athcodec.sources, athcodec.cli; assert 'asyncio' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_a_strange_prelude_costs_no_more_than_its_limits(server):
    """A header that announces gigabytes is refused before they are asked for."""
    parts = Parts.of(server.data)
    server.data = server.data[:24] + (2**19).to_bytes(4, "little") + server.data[28:]
    with pytest.raises((Truncated, athcodec.errors.FormatError)):
        athcodec.open(server.url)
    assert parts.header.chunk_count < 2**19 and sum(stop - start for start, stop in server.ranges) <= len(server.data)
