"""Tests a decoder of .ath files against the vectors of spec/vectors.

    python -m spec.conformance DECODER-COMMAND...          any program
    python -m spec.conformance --own c|wasm|document       those of this repository
    python -m spec.conformance --own gpu                   likewise, of the approximate class
    python -m spec.conformance --approximate ...           decoders of the approximate class
    python -m spec.conformance --profile small ...         decoders of the small profile

A program is called as `DECODER-COMMAND... FILE ITEM` for every item of every vector, and with one argument more,
`MESH`, where a file of the vector's name ends in .mesh: the positions of the host's mesh, binary32, little-endian, in
source order, to be given to the decoder before it is asked for `rest` or a level. It has to write the answer, raw,
to its standard output and exit with 0; or, where the file is to be refused, the error's name (FORMAT.md,
"Errors") as the first word of its standard error, and exit with another status. The items:

    strict      opens strictly; no answer
    open        opens for streaming, as all that follow; no answer
    0, 1, ...   positions of that level: frames of all clips x vertices x 3 numbers, little-endian, in source
                order, binary64 where Is_Float64 is set, else binary32
    rest        the rest pose, as the reference pose of level 0 gives it: vertices x 3 numbers of Rest_Type,
                little-endian, in source order
    time        the time of every frame, clip by clip, binary64, little-endian
    clips       the entries of CLIPS, written from the decoder's values for every clip: frames, segments, flags,
                name, seams; for a file without CLIPS, the entry that it would have
    static      Text of METADATA, then the elements of all arrays in file order, unshuffled, gaps included;
                derived edges as if they were stored

An item whose level or chunk has not arrived is TRUNCATED. A decoder without static data or strict mode, or with other
limits than FORMAT.md, is tested with --without. FORMAT.md, "Conformance" and "Limits", has the classes and profiles.
Of an approximate decoder the largest distance is printed, in tolerances; its positions are asked for at the vectors
real-size-* alone. The exit status is 0 if all results are as expected.
"""

from __future__ import annotations

import argparse
import base64
import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from functools import lru_cache, partial
from io import BytesIO
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from spec.document import File, clip_entry, crc32c, limits_of, rules

FOLDER = Path(__file__).resolve().parent / "vectors"
DECODER_MODULE = Path(__file__).resolve().parent.parent / "athcodec" / "viewer" / "ath_decoder.mjs"
ERRORS = tuple(
    "INVALID NOT_AN_ATH_FILE UNSUPPORTED_VERSION TRUNCATED BAD_CHECKSUM BAD_HEADER BAD_CHUNK_TABLE UNKNOWN_CHUNK "
    "BAD_CHUNK LIMIT_EXCEEDED TRAILING_BYTES NEEDS_HOST_MESH WRONG_HOST_MESH UNSUPPORTED_FEATURE".split()
)
NO_ANSWER = ("strict", "open")
SECONDS = 120
PROFILES = ("full", "small")
APPROXIMATE = "valid/real-size-*"  # Vectors whose positions an approximate decoder is asked for.
LISTING = """\
Vectors of the .ath format. A line is: the file, the CRC-32C of its bytes, ITEM=RESULT for each item, then # and the
reason. RESULT is ok, the name of an error, or the CRC-32C (FORMAT.md, "Checksums") of these bytes, little-endian,
one after the other and nothing between them. The limits are those of the full profile (FORMAT.md, "Limits"). The host's
mesh of NAME.ath is NAME.mesh beside it, N times x, y, z in binary32; without that file no mesh is given. The items:
0, 1, ...  the positions of that level: for each frame of all clips, in their order, repeats included, for each vertex
           in source order x, y, z: binary64 where Is_Float64 is set, else binary32; every NaN is the quiet one
           (0x7fc00000 or 0x7ff8000000000000)
rest       the rest pose, as the reference pose of level 0 gives it: for each vertex in source order x, y, z of
           Rest_Type
time       the time of each frame of all clips, binary64
clips      the entries of CLIPS, Periodic left at 0; the one that there would be where there is no CLIPS
static     Text of METADATA, then the elements of FACES, of EDGES (derived ones as if stored), of face_vertex_counts and
           face_vertex_indices, and of each ATTRIBUTE in file order, unshuffled, in the byte order of their types
Lines and files are only ever added.
"""


class Refused(Exception):
    """A decoder refuses a file; the message is the error's name."""


@dataclass(frozen=True)
class Vector:
    name: str  # such as valid/smallest.ath
    checksum: str
    results: dict[str, str]  # by item
    reason: str

    @property
    def path(self) -> Path:
        return FOLDER / self.name

    @property
    def mesh_path(self) -> Path | None:
        """Of the host's mesh, where there is one."""
        path = self.path.with_suffix(".mesh")
        return path if path.exists() else None

    @property
    def mesh(self) -> bytes | None:
        return self.mesh_path and self.mesh_path.read_bytes()

    @property
    def valid(self) -> bool:
        return self.name.startswith("valid/")


# Answers jobs (vector, item) in their order: bytes, Refused, or an OSError for a fault of the decoder.
Decoder = Callable[[list[tuple[Vector, str]]], Iterable[bytes | Exception]]


# ---- the listing -------------------------------------------------------------------------------------------


def vectors() -> list[Vector]:
    """Return the vectors listed in expected.txt."""
    lines = (FOLDER / "expected.txt").read_text("utf-8").splitlines()
    return [parse_line(line) for line in lines if line and not line.startswith("#")]


def parse_line(line: str) -> Vector:
    facts, reason = line.split(" # ", 1)
    name, checksum, *results = facts.split()
    return Vector(name, checksum, dict(result.split("=") for result in results), reason)


def format_line(name: str, data: bytes, results: dict[str, str], reason: str) -> str:
    listed = " ".join(f"{item}={result}" for item, result in results.items())
    return f"{name} {crc32c(data):08x} {listed} # {reason}"


def checksum_of(data: bytes, item: str, answer: bytes) -> str:
    """Return RESULT of an answer to an item of a file."""
    if item in NO_ANSWER:
        return "ok" if not answer else "bytes where none are asked for"
    if item.isdecimal():
        answer = with_quiet_nans(answer, positions_type(data))
    return f"{crc32c(answer):08x}"


@lru_cache(maxsize=8)
def positions_type(data: bytes) -> str:
    """Return the type of the positions of a file whose front is whole."""
    return "<f8" if rules.read_front(data)[0].is_float64 else "<f4"


def with_quiet_nans(answer: bytes, kind: str) -> bytes:
    """Return the answer with all NaNs replaced by the quiet one, since sign and payload are not defined."""
    if len(answer) % np.dtype(kind).itemsize:
        return answer
    numbers = np.frombuffer(answer, kind).copy()
    numbers[np.isnan(numbers)] = np.nan
    return numbers.tobytes()


# ---- testing -----------------------------------------------------------------------------------------------


def failures(decoder: Decoder, chosen: list[Vector], without: Iterable[str] = ()) -> Iterator[str]:
    """Yield a line for each item whose result differs from expected.txt."""
    jobs = asked(chosen, without)
    for (vector, item), answer in zip(jobs, decoder(jobs), strict=True):
        yield from complaint(vector, item, result_of(vector.path.read_bytes(), item, answer))


def asked(chosen: list[Vector], without: Iterable[str] = ()) -> list[tuple[Vector, str]]:
    """Return pairs of a vector and an item that a decoder is asked for, but for the items in `without`; "levels" there
    leaves out all levels, and "limits" all items that exceed a limit.
    """
    left_out = set(without)
    return [
        (vector, item)
        for vector in chosen
        for item, result in vector.results.items()
        if item not in left_out
        and not ("levels" in left_out and item.isdecimal())
        and not ("limits" in left_out and result == "LIMIT_EXCEEDED")
    ]


def complaint(vector: Vector, item: str, got: str) -> Iterator[str]:
    expected = vector.results[item]
    if got != expected:
        yield f"{vector.name}, {item}: got {got}; expected {expected}: {vector.reason}"


class Approximately:
    """Tests a decoder of the approximate class; `largest` is the largest distance so far, in tolerances."""

    def __init__(self) -> None:
        self.largest = 0.0

    def failures(self, decoder: Decoder, chosen: list[Vector], without: Iterable[str] = ()) -> Iterator[str]:
        """Yield a line for each item whose result is wrong. Positions may differ from those of an exact decoder by a
        tolerance.
        """
        jobs = [job for job in asked(chosen, without) if not is_position(*job) or is_measured(*job)]
        for (vector, item), answer in zip(jobs, decoder(jobs), strict=True):
            if not is_position(vector, item) or isinstance(answer, Exception):
                yield from complaint(vector, item, result_of(vector.path.read_bytes(), item, answer))
                continue
            got = self.tolerances(vector, int(item), answer)
            self.largest = max(self.largest, got)
            if not got <= 1.0:
                yield f"{vector.name}, {item}: got positions {got:.3g} tolerances from those of an exact decoder"

    def tolerances(self, vector: Vector, level: int, answer: bytes) -> float:
        """Return how far the furthest vertex of a decoder's answer is from its exact position, in tolerances: 1 is the
        largest distance allowed, and infinity means an answer of another length.
        """
        data = vector.path.read_bytes()
        kind = positions_type(data)
        exact, deepest = (np.frombuffer(package(data, str(at), vector.mesh), kind) for at in (level, last_level(data)))
        if len(answer) != exact.nbytes:
            return np.inf
        distances = np.linalg.norm((np.frombuffer(answer, kind).astype(float) - exact).reshape(-1, 3), axis=1)
        return float(distances.max() / tolerance(deepest.reshape(-1, 3), rules.read_front(data)[0].max_error))


def is_position(vector: Vector, item: str) -> bool:
    """Return whether the expected answer to an item is positions or a rest pose."""
    return needs_rest(item) and vector.results[item] not in ERRORS


def is_measured(vector: Vector, item: str) -> bool:
    return item.isdecimal() and fnmatch(vector.name, APPROXIMATE)


def last_level(data: bytes) -> int:
    return rules.read_front(data)[0].level_count - 1


def tolerance(deepest: np.ndarray, max_error: float) -> float:
    """Return how far positions may be off that are given with Origin added; deepest: those of the deepest level, (V,
    3)."""
    diagonal = float(np.linalg.norm(np.ptp(deepest.astype(float), axis=0)))
    return max(max_error / 16, diagonal * 2.0**-18, float(np.abs(deepest).max()) * 2.0**-22)


@contextmanager
def profile(name: str) -> Iterator[None]:
    """Return the code of FORMAT.md with the limits of a profile."""
    kept, rules.limit = rules.limit, limits_of(name).__getitem__
    try:
        yield
    finally:
        rules.limit = kept


def of_profile(vector: Vector, name: str) -> Vector:
    """Return the vector with the results that a decoder of a profile gives."""
    jobs = [(vector, item) for item in ("open", "static") if item in vector.results]
    answers = one_by_one({"full": document, "small": small_document}[name])(jobs)
    beyond = {item for (_, item), answer in zip(jobs, answers) if str(answer) == "LIMIT_EXCEEDED"}
    changed = set(vector.results) if "open" in beyond else beyond
    return replace(vector, results=vector.results | dict.fromkeys(changed, "LIMIT_EXCEEDED"))


def result_of(data: bytes, item: str, answer: bytes | Exception) -> str:
    return checksum_of(data, item, answer) if isinstance(answer, bytes) else str(answer)


def items(data: bytes) -> list[str]:
    """Return the items of a file; if it cannot be opened, only those without an answer."""
    try:
        file = File(data)
    except rules.Invalid:
        return list(NO_ANSWER)
    return [*NO_ANSWER, *map(str, range(file.header.level_count)), "rest", "time", "clips", "static"]


def result(ask: Callable[..., bytes], data: bytes, item: str, mesh: bytes | None = None) -> str:
    """Return RESULT of one item, by a function that raises Refused."""
    try:
        return checksum_of(data, item, ask(data, item, mesh))
    except Refused as error:
        return str(error)


# ---- decoders ----------------------------------------------------------------------------------------------


def command(words: list[str]) -> Decoder:
    """Yield a program, called by the protocol above."""

    def decoder(jobs: list[tuple[Vector, str]]) -> Iterator[bytes | Exception]:
        for vector, item in jobs:
            yield ask_command([*words, str(vector.path), item, *filter(None, [vector.mesh_path])])

    return decoder


def ask_command(words: list[str | Path]) -> bytes | Exception:
    """Run a decoder's command line and return what it writes to standard output. Return, and do not raise, Refused with
    the error's name that it prints, or OSError if it crashes or takes too long.
    """
    try:
        done = subprocess.run(words, capture_output=True, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        return OSError(f"no answer within {SECONDS} s")
    if done.returncode == 0:
        return done.stdout
    first = (done.stderr.decode(errors="replace").split() or [""])[0].strip(":")
    if done.returncode < 0 or first not in ERRORS:
        return OSError(f"exit status {done.returncode} and no error's name")
    return Refused(first)


def one_by_one(ask: Callable[[bytes, str, bytes | None], bytes]) -> Decoder:
    """Return a decoder that answers a list of vectors and items one after the other. `ask` takes a file's bytes, an
    item and the host's mesh, and returns the answer or raises Refused.
    """

    def decoder(jobs: list[tuple[Vector, str]]) -> Iterator[bytes | Exception]:
        for vector, item in jobs:
            try:
                yield ask(vector.path.read_bytes(), item, vector.mesh)
            except Refused as error:
                yield error

    return decoder


def needs_rest(item: str) -> bool:
    return item == "rest" or item.isdecimal()


@lru_cache(maxsize=1)
def opened(data: bytes, strict: bool, mesh: bytes | None) -> File:
    return File(data, strict, mesh)


def document(data: bytes, item: str, mesh: bytes | None = None) -> bytes:
    """Return the code of FORMAT.md."""
    try:
        return opened(data, item == "strict", mesh if needs_rest(item) else None).answer(item)
    except rules.Invalid as error:
        raise Refused(str(error)) from None


def small_document(data: bytes, item: str, mesh: bytes | None = None) -> bytes:
    """Return the code of FORMAT.md with the limits of the small profile."""
    with profile("small"):
        opened.cache_clear()
        try:
            return document(data, item, mesh)
        finally:
            opened.cache_clear()


def package(data: bytes, item: str, mesh: bytes | None = None, is_small: bool = False) -> bytes:
    """Return the answer of this package, the C core through Python, to an item about a file. `mesh` has the bytes of
    the host's mesh and `is_small` selects the limits of the small profile; raise Refused if the file is refused.
    """
    import athcodec
    from athcodec.decoding.container import Limits
    from athcodec.errors import FormatError, LevelUnavailable

    limits = Limits.small() if is_small else None
    try:
        with athcodec.open(BytesIO(data), strict=item == "strict", limits=limits) as decoder:
            if mesh is not None and needs_rest(item):
                decoder.file.set_host_mesh(np.frombuffer(mesh, "<f4").reshape(-1, 3))
            return ask_package(decoder, item)
    except FormatError as error:
        raise Refused(error.name) from None
    except LevelUnavailable:  # The file stores the level, but it has not arrived.
        raise Refused("TRUNCATED") from None


def ask_package(decoder, item: str) -> bytes:
    """Return the bytes that answer an item, from an opened file: positions of a level, the rest pose, the times, the
    clips or the static data; no bytes for items that only open the file.
    """
    if item in NO_ANSWER:
        return b""
    if item == "rest":
        return decoder.file.rest_at(0).tobytes()
    if item == "clips":
        return b"".join(clip_entry(by_document(clip)) for clip in decoder.file.clips)
    if item != "static":
        played = (decoder.play(clip.name) for clip in decoder.file.clips)
        return b"".join((clip.time if item == "time" else clip.positions(level=int(item))).tobytes() for clip in played)
    arrays = [decoder.file.faces, decoder.file.edges, *decoder.file.attributes.values()]
    return metadata_text(decoder) + b"".join(array.tobytes() for array in arrays if array is not None)


def by_document(clip) -> SimpleNamespace:
    """Return a clip of the package as the document has it."""
    seams = clip.seam_errors if clip.loop else None
    return SimpleNamespace(frames=clip.frame_count, segments=clip.segment_count, name=clip.name, seams=seams)


def metadata_text(decoder) -> bytes:
    """Return the metadata of a file as its stored JSON text, or no bytes if the file has none."""
    from athcodec.decoding import container

    _ = decoder.metadata  # refuses what is no JSON object
    chunk = decoder.file.chunks.find(container.METADATA)
    if chunk is None:
        return b""
    content = decoder.file.chunks.payload(chunk)
    return rules.parse_metadata(content)


NODE_SCRIPT = """
import { readFileSync } from "node:fs";
const jobs = JSON.parse(readFileSync(0, "utf8"));
const { AthFile, AthError, ready } = await import(jobs.module);
await ready;
const items = {
  open: () => new Uint8Array(0),
  rest: (file) => {
    file.levelRest(0);  // It may be about another pose than REST.
    return file.rest("source", { out: new (file.info.restIsFloat64 ? Float64Array : Float32Array)(
      3 * file.info.vertexCount) });
  },
  time: (file) => file.times(),
  clips: (file) => Buffer.concat(file.clips.map((clip, i) => entry(file, clip, i))),
};
const entry = (file, { name, frameCount, segmentCount, loop }, clip) => {
  const text = Buffer.from(name), seams = new Float32Array(loop ? file.info.fullLevelCount : 0);
  const head = Buffer.from([...new Uint8Array(Uint32Array.of(frameCount, segmentCount).buffer), loop, text.length]);
  return Buffer.concat([head, text, Buffer.from(seams.map((_, level) => file.seamError(clip, level)).buffer)]);
};
const positions = (file, level) => {
  const numbers = file.info.isFloat64 ? Float64Array : Float32Array, size = 3 * file.info.vertexCount;
  const all = new numbers(size * file.info.frameCount);
  for (let s = 0; s < file.info.segmentCount; s++) {
    const segment = file.prepare(s, level);
    for (let t = file.segmentStart(s); t < file.segmentStart(s + 1); t++)
      all.set(file.positions([segment], t, { out: new numbers(size) }), size * t);
    segment.free();
  }
  return all;
};
const answer = ({ path, item, mesh }) => {
  const file = AthFile.open(new Uint8Array(readFileSync(path)), { profile: jobs.profile });
  if (mesh) file.setHostMesh(new Float32Array(new Uint8Array(readFileSync(mesh)).buffer));
  const array = items[item] ? items[item](file) : positions(file, Number(item));
  const bytes = Buffer.from(array.buffer, array.byteOffset, array.byteLength).toString("base64");
  file.dispose();
  return { bytes };
};
const answers = jobs.jobs.map((job) => {
  try {
    return answer(job);
  } catch (error) {
    return error instanceof AthError ? { error: error.codeName } : { fault: String(error) };
  }
});
console.log(JSON.stringify(answers));
"""


def web_assembly(jobs: list[tuple[Vector, str]], profile: str = "full") -> list[bytes | Exception]:
    """Return the answers of the decoder for web pages, which runs in Node, to pairs of a vector and an item. The
    decoder opens files for streaming and returns static data as stored; an error is returned in place of an answer.
    """
    node = shutil.which("node")
    if node is None:
        raise OSError("node: got none on PATH; expected Node.js 18 or newer")
    asked = [
        {"path": str(vector.path), "item": item}
        | ({"mesh": str(vector.mesh_path)} if vector.mesh_path and needs_rest(item) else {})
        for vector, item in jobs
    ]
    request = {"module": DECODER_MODULE.as_uri(), "jobs": asked, "profile": profile}
    done = subprocess.run(
        [node, "--input-type=module", "-e", NODE_SCRIPT],
        input=json.dumps(request),
        capture_output=True,
        text=True,
        timeout=SECONDS,
    )
    if done.returncode != 0:
        raise OSError(f"node: {done.stderr.strip()}")
    return [node_answer(vector, answer) for (vector, _), answer in zip(jobs, json.loads(done.stdout), strict=True)]


def node_answer(vector: Vector, answer: dict) -> bytes | Exception:
    """Return the bytes of an answer of the decoder in Node, or the error that it stands for. A complete file is
    assumed, so missing bytes mean a file that is truncated.
    """
    if "bytes" in answer:
        return base64.b64decode(answer["bytes"])
    if "fault" in answer:
        return OSError(answer["fault"])
    if answer["error"] == "MISSING":
        return Refused("TRUNCATED" if vector.path.stat().st_size else "NOT_AN_ATH_FILE")
    return Refused(answer["error"])


def gpu_form(data: bytes, item: str, mesh: bytes | None = None) -> bytes:
    """Return the answer to an item about a file. Positions are computed by the passes of docs/gpu.md in float32, with
    the file's origin added; all other items are answered by the package.
    """
    from athcodec.gpu import GpuFile
    from athcodec.gpu.evaluate import Passes, Source

    if not item.isdecimal():
        return package(data, item, mesh)
    gpu, blocks = GpuFile(data, None if mesh is None else np.frombuffer(mesh, "<f4").reshape(-1, 3)), []
    info, level = gpu.core.info, int(item)
    starts = gpu.core.segment_starts(range(info.segment_count + 1))
    for segment in range(info.segment_count):
        coded = np.array([gpu.coded_frame(frame) for frame in range(starts[segment], starts[segment + 1])])
        blocks.append(Passes(gpu.level(level), Source(gpu.segment(segment, level), coded)).vertices())
    positions = np.concatenate(blocks).astype(float)[:, gpu.core.vertex_places()] + np.array(info.origin)
    return positions.astype(positions_type(data)).tobytes()


@dataclass(frozen=True)
class Own:
    decoder: Decoder
    small: Decoder  # With the limits of the small profile.
    without: tuple[str, ...] = ()


OWN = {
    "c": Own(one_by_one(package), one_by_one(partial(package, is_small=True))),
    "wasm": Own(web_assembly, partial(web_assembly, profile="small"), ("strict", "static")),
    "document": Own(one_by_one(document), one_by_one(small_document)),
}
OWN_APPROXIMATE = {"gpu": Own(one_by_one(gpu_form), one_by_one(gpu_form), ("static",))}


# ---- command -----------------------------------------------------------------------------------------------


def main(words: list[str] | None = None) -> int:
    """Test a decoder against the vectors, and print the failures and a summary. Return the exit status: 0 if there are
    no failures.
    """
    parser = argparse.ArgumentParser(
        prog="python -m spec.conformance",
        description="Tests a decoder of .ath files against the vectors of spec/vectors.",
        epilog="spec/conformance.py describes how DECODER-COMMAND is called.",
    )
    parser.add_argument("--own", choices=OWN | OWN_APPROXIMATE, help="a decoder of this repository")
    parser.add_argument("--approximate", action="store_true", help="a decoder of the approximate class")
    parser.add_argument("--profile", choices=PROFILES, default="full", help="profile of the decoder (default: full)")
    parser.add_argument("--only", metavar="GLOB", default="*", help="vectors whose name matches")
    parser.add_argument(
        "--without",
        metavar="ITEM",
        action="append",
        default=[],
        help="leave out items that a decoder does not support: strict, open, levels, rest, time, "
        "clips, static, limits; may be repeated",
    )
    parser.add_argument("command", nargs=argparse.REMAINDER, metavar="DECODER-COMMAND")
    options = parser.parse_args(words)
    if bool(options.own) == bool(options.command):
        parser.error("expected a DECODER-COMMAND or --own")
    decoder, without = command(options.command), tuple(options.without)
    if options.own:
        ours = (OWN | OWN_APPROXIMATE)[options.own]
        decoder, without = ours.small if options.profile == "small" else ours.decoder, without + ours.without
    chosen = [vector for vector in vectors() if fnmatch(vector.name, options.only)]
    if options.profile != "full":
        chosen = [of_profile(vector, options.profile) for vector in chosen]
    approximately, failed = Approximately(), 0
    is_approximate = options.approximate or options.own in OWN_APPROXIMATE
    for line in (approximately.failures if is_approximate else failures)(decoder, chosen, without):
        print(line)
        failed += 1
    print(f"{len(chosen)} vectors, {failed} wrong" + (f", without {', '.join(without)}" if without else ""))
    if is_approximate:
        print(f"the furthest vertex is {approximately.largest:.3g} tolerances off")
    return 1 if failed or not chosen else 0


if __name__ == "__main__":
    sys.exit(main())
