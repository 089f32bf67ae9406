"""The vectors of spec/vectors: whole, of every rule, and decoded as expected.txt says by the C core, the
WebAssembly decoder and the code of FORMAT.md; and the program that tests the decoders of others."""

from __future__ import annotations

import hashlib
import re
import sys
from fnmatch import fnmatch
from pathlib import Path

import numpy as np
import pytest
from programs import printed

from athcodec import errors
from athcodec.decoding import container
from athcodec.decoding.ath_file import AthFile
from spec import conformance, document, real_size
from spec.document import rules

ROOT = Path(__file__).resolve().parent.parent
VECTORS = conformance.vectors()
COUNT_OF_1_0 = 1101
DIGEST_OF_1_0 = "e43c0d5fc1941ef47aa9c60c469e34c111b5773293932d208f1f3d84bf8eeed1"


def run(*words, code: int = 0) -> str:
    """What the program prints."""
    return printed(sys.executable, "-m", "spec.conformance", *words, code=code, cwd=ROOT)


# ---- the files ---------------------------------------------------------------------------------------------


def test_the_checksums_of_all_files_of_the_vectors_are_listed():
    sums = dict(line.split("  ")[::-1] for line in (conformance.FOLDER / "SHA256SUMS").read_text("utf-8").splitlines())
    files = {path for path in conformance.FOLDER.rglob("*") if path.is_file() and path.name != "SHA256SUMS"}
    assert sums == {
        path.relative_to(conformance.FOLDER).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in files
    }


def test_every_file_is_listed_once_and_has_not_changed():
    """A file that does not fit its line is a mistake."""
    files = {str(path.relative_to(conformance.FOLDER)) for path in conformance.FOLDER.rglob("*.ath")}
    assert sorted(vector.name for vector in VECTORS) == sorted(files)
    for vector in VECTORS:
        assert f"{container.crc32c(vector.path.read_bytes()):08x}" == vector.checksum, vector.name


def test_vectors_of_1_0_stay_as_they_are_with_all_that_they_decode_to():
    """Lines are only added behind them. Their reasons may be said better."""
    lines = (conformance.FOLDER / "expected.txt").read_text("utf-8").splitlines()
    results = [line.partition(" # ")[0] for line in lines if not line.startswith("#")]
    of_1_0 = "\n".join(results[:COUNT_OF_1_0])
    assert hashlib.sha256(of_1_0.encode()).hexdigest() == DIGEST_OF_1_0


def test_the_listing_begins_with_what_its_lines_mean():
    lines = (conformance.FOLDER / "expected.txt").read_text("utf-8").splitlines()
    head = [line.removeprefix("# ") for line in lines if line.startswith("#")]
    assert head == conformance.LISTING.splitlines()


def test_there_are_over_eighty_vectors_in_less_than_a_megabyte():
    sizes = [vector.path.stat().st_size for vector in VECTORS]
    assert sum(vector.valid for vector in VECTORS) >= 40 and sum(not vector.valid for vector in VECTORS) >= 40
    assert sum(sizes) < 1 << 20 and sorted(sizes)[len(sizes) * 9 // 10] < 2048


def test_valid_files_are_wholly_valid_and_invalid_ones_are_not():
    for vector in VECTORS:
        wrong = [result for result in vector.results.values() if result in conformance.ERRORS]
        assert bool(wrong) != vector.valid, vector.name
        assert {"strict", "open"} <= set(vector.results) and len(vector.reason) > 5


def test_every_error_has_a_vector():
    """But INVALID, which nothing has to say."""
    seen = {result for vector in VECTORS for result in vector.results.values()} & set(conformance.ERRORS)
    names = {error.name for error in (errors.FormatError, *errors.FormatError.__subclasses__())}
    assert set(conformance.ERRORS) == names and seen == names - {"INVALID"}


def kinds_in(path: Path) -> set[int]:
    """Of chunks that are known."""
    with path.open("rb") as file:
        return {chunk.kind for chunk in AthFile(file, strict=True).chunks}


def test_every_kind_of_chunk_is_in_a_valid_file():
    kinds = [kinds_in(vector.path) for vector in VECTORS if vector.valid]
    assert set().union(*kinds) == set(container.KIND_NAMES)
    assert any({container.PREDICTED, container.STEMS, container.CORRECTIONS} <= of_one for of_one in kinds)


def test_all_kinds_of_chunks_that_stand_together_are_in_one_valid_file():
    """And chunks that are to be skipped; but for predicted motion, which most files hold alone."""
    path = conformance.FOLDER / "valid/everything.ath"
    assert kinds_in(path) == set(container.KIND_NAMES) - {container.PREDICTED}
    with path.open("rb") as file:
        opened = AthFile(file, strict=True)
        assert opened.tables.header.chunk_count > len(opened.chunks) and opened.tables.header.is_float64


def test_every_field_has_a_vector_that_breaks_its_range():
    """By the field tables of FORMAT.md. What has no range of its own has no vector."""
    text = (ROOT / "FORMAT.md").read_text("utf-8")
    rows = re.findall(r"^\| (?:\d|behind)[^|]* \| [^|]+ \| ([A-Z]\w+) \| [^|]+ \| ([^|]+) \|$", text, re.M)
    fields = {name for name, values in rows if not values.startswith("any")}
    reasons = " ".join(vector.reason for vector in VECTORS if not vector.valid)
    streams = {name for name in fields if name.endswith(("_Stream", "_Body"))} | {"Text", "Head"}
    unnamed = {"Kind", "Length", "Checksum", "Level", "Segment"}  # theirs are the table-... vectors
    missing = {name for name in fields - streams - unnamed if name not in reasons}
    assert missing == set()


def test_vectors_of_real_size_use_the_features_of_the_format_together():
    """All kinds of chunks, in the one file those that athcodec puts together."""
    paths = {name: conformance.FOLDER / f"valid/real-size-{name}.ath" for name in real_size.OPTIONS}
    uses = {name: real_size.features(path.read_bytes()) for name, path in paths.items()}
    assert set().union(*uses.values()) >= real_size.FEATURES | set(document.KINDS)
    others = {"joins", "sloped joins", "loose branches", "learned bases", "exact rest pose", "predicted motion"}
    assert real_size.FEATURES - uses["all"] <= others
    assert 50_000 < paths["all"].stat().st_size < 160_000


@pytest.mark.vectors
def test_scripts_still_make_the_very_same_files():
    """How they were made stays true."""
    from spec import make

    for vector in make.VECTORS:
        if vector.scripted:
            assert vector.make() == (conformance.FOLDER / vector.path).read_bytes(), vector.path


@pytest.mark.vectors
def test_existing_vectors_are_left_alone(tmp_path):
    from spec import make

    folder = tmp_path / "vectors"
    kept, listed = "valid/smallest.ath 00000000 strict=ok # an older one", folder / "expected.txt"
    (folder / "valid").mkdir(parents=True)
    (folder / "valid/smallest.ath").write_bytes(b"older")
    others = "\n".join(
        f"{vector.path} 00000000 # there" for vector in make.VECTORS if vector.name not in ("smallest", "smallest-wide")
    )
    listed.write_text(f"# head\n{kept}\n{others}\n")
    assert make.write(folder=folder) == 1
    assert (folder / "valid/smallest.ath").read_bytes() == b"older" and kept in listed.read_text()
    assert (folder / "valid/smallest-wide.ath").exists() and "valid/smallest-wide.ath" in listed.read_text()


# ---- the decoders of this repository -----------------------------------------------------------------------


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name == "c" else pytest.mark.vectors) for name in conformance.OWN]
)
def test_own_decoders_answer_as_expected(name, monkeypatch):
    monkeypatch.setattr(conformance, "crc32c", container.crc32c)  # the same, by the core: the program's takes a while
    own = conformance.OWN[name]
    if name == "wasm" and conformance.shutil.which("node") is None:
        pytest.fail("node: got none on PATH, expected Node.js 18 or newer to test the WebAssembly decoder in")
    assert list(conformance.failures(own.decoder, VECTORS, own.without)) == []


BEYOND_SMALL = ["valid/depth-4096.ath", "valid/metadata-longest.ath", "invalid/table-longest-chunk.ath"]


def test_decoders_of_the_small_profile_refuse_what_is_beyond_it():
    """And open what is within it: one vector stands here for all that `--profile small` asks."""
    chosen = [vector for vector in VECTORS if vector.name in BEYOND_SMALL]
    small = [conformance.of_profile(vector, "small") for vector in chosen]
    assert all("LIMIT_EXCEEDED" in vector.results.values() for vector in small)
    within = next(vector for vector in VECTORS if vector.name == "valid/private-kinds.ath")
    assert conformance.of_profile(within, "small") == within
    for name in ("c", "wasm"):
        own = conformance.OWN[name]
        assert list(conformance.failures(own.small, [*small, within], own.without)) == []


@pytest.mark.parametrize("off, passes", [(0.5, True), (2.0, False)])
def test_an_approximate_decoder_passes_within_the_tolerance_and_not_beyond_it(off, passes):
    """Every vertex is off by the given number of tolerances along an axis."""
    vector = min((v for v in VECTORS if fnmatch(v.name, conformance.APPROXIMATE)), key=lambda v: v.path.stat().st_size)
    data, test = vector.path.read_bytes(), conformance.Approximately()
    kind = conformance.positions_type(data)

    def decode(data, item, mesh):
        answer = conformance.package(data, item, mesh)
        if not item.isdecimal():
            return answer
        deepest = np.frombuffer(conformance.package(data, str(conformance.last_level(data)), mesh), kind)
        length = conformance.tolerance(deepest.reshape(-1, 3), rules.read_front(data)[0].max_error)
        moved = np.frombuffer(answer, kind).reshape(-1, 3) + np.array([off * length, 0, 0])
        return moved.astype(kind).tobytes()

    complaints = list(test.failures(conformance.one_by_one(decode), [vector]))
    levels = [item for item in vector.results if item.isdecimal()]
    assert (complaints == []) == passes and len(complaints) in (0, len(levels))
    assert test.largest == pytest.approx(off, rel=0.05)


@pytest.mark.web
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_the_form_for_a_gpu_is_an_approximate_decoder():
    own, test = conformance.OWN_APPROXIMATE["gpu"], conformance.Approximately()
    chosen = [vector for vector in VECTORS if fnmatch(vector.name, conformance.APPROXIMATE)]
    assert list(test.failures(own.decoder, chosen, own.without)) == [] and 0.0 < test.largest < 1.0


def test_the_document_decodes_the_smallest_vectors():
    own, smallest = conformance.OWN["document"], sorted(VECTORS, key=lambda vector: vector.path.stat().st_size)[:100]
    assert list(conformance.failures(own.decoder, smallest, own.without)) == []


# ---- the decoders of others --------------------------------------------------------------------------------

DOCUMENT = [sys.executable, str(ROOT / "spec" / "document.py")]


def decoder_that(tmp_path, body: str) -> list[str]:
    """A program that asks the document, then does something of its own with `data` or `error`."""
    script = tmp_path / "decoder.py"
    script.write_text(f"""
import sys, subprocess, os
done = subprocess.run({DOCUMENT!r} + sys.argv[1:], capture_output=True)
item, data, error = sys.argv[2], done.stdout, done.stderr
{body}
sys.stdout.buffer.write(data)
sys.stderr.buffer.write(error)
sys.exit(done.returncode)
""")
    return [sys.executable, str(script)]


@pytest.mark.tools
def test_a_program_that_decodes_well_passes(tmp_path):
    assert "1 vectors, 0 wrong" in run("--only", "invalid/cut-in-attributes.ath", *DOCUMENT)


@pytest.mark.tools
@pytest.mark.parametrize(
    "body, only, complaint",
    [
        ("data = bytes([data[0] ^ 1]) + data[1:] if item == '1' else data", "valid/all-at-origin.ath", "1: got "),
        (
            "error = error.replace(b'BAD_CHUNK', b'BAD_HEADER')",
            "invalid/time-equal.ath",
            "got BAD_HEADER; expected BAD_CHUNK",
        ),
        ("error = b''", "invalid/time-equal.ath", "exit status 1 and no error's name"),
        ("done.returncode = 0", "invalid/time-equal.ath", "open: got ok; expected BAD_CHUNK"),
        ("os.abort()", "valid/all-at-origin.ath", "exit status -6 and no error's name"),
        ("data = b''", "valid/all-at-origin.ath", "0: got 00000000"),
        ("data = data.replace(b'storm', b'Storm')", "valid/clips-two.ath", "clips: got "),
    ],
    ids=["other bits", "another error", "no error's name", "no error", "a crash", "nothing", "another name"],
)
def test_a_wrong_answer_of_a_program_is_reported(body, only, complaint, tmp_path):
    printed = run("--only", only, *decoder_that(tmp_path, body), code=1)
    assert complaint in printed and only in printed and "0 wrong" not in printed


@pytest.mark.tools
def test_what_a_decoder_leaves_out_is_not_asked_for(tmp_path):
    broken = decoder_that(tmp_path, "if item in ('static', 'strict'): os.abort()")
    left_out = ["--without", "static", "--without", "strict", "--without", "levels"]
    assert "0 wrong" in run("--only", "valid/all-at-origin.ath", *left_out, *broken)


@pytest.mark.tools
def test_limits_of_a_decoder_s_own_can_be_left_out(tmp_path):
    unlimited = decoder_that(tmp_path, "if b'LIMIT_EXCEEDED' in error: error, done.returncode = b'', 0")
    chosen = ["--only", "invalid/header-vertices-limit.ath"]
    assert "got ok; expected LIMIT_EXCEEDED" in run(*chosen, *unlimited, code=1)
    assert "0 wrong" in run("--without", "limits", *chosen, *unlimited)


def test_halves_of_wide_numbers_are_no_nans():
    data = (conformance.FOLDER / "valid/smallest-wide.ath").read_bytes()
    number = bytes.fromhex("0100a0ffffffef3f")  # just below 1
    assert conformance.checksum_of(data, "1", number) == f"{conformance.crc32c(number):08x}"


def test_a_nan_is_a_nan_whatever_its_bits():
    data = (conformance.FOLDER / "valid/not-a-number.ath").read_bytes()
    quiet, other = bytes.fromhex("0000c07f"), bytes.fromhex("0100a0ff")
    assert conformance.checksum_of(data, "1", quiet) == conformance.checksum_of(data, "1", other)
    assert conformance.checksum_of(data, "static", quiet) != conformance.checksum_of(data, "static", other)


def test_no_vector_at_all_is_a_failure():
    assert "0 vectors" in run("--only", "no such name", "--own", "document", code=1)
