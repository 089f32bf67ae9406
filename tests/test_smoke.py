"""Parts that only later tiers build or run at length: each is built here and run once on something small, so that none
can break unseen until then.

| part | its tests | smoke test here |
|---|---|---|
| other codecs of the benchmark | tools | each codes one clip, and the bound is checked |
| verbs of the benchmark | tools, programs | each measures one clip; those that draw in a browser list their options |
| makers of the benchmark's clips | tools, programs | makers that need no other program make a small clip |
| tables of documents | tools | they are those of the stored results |
| fuzz targets, programs for threads, faults and other machines | tools, slow, machines | each compiles and runs once |
| fuzzing of readers | tools, slow | a reader is given its first seed |
| hostile files, faults, the report on them | tools, slow | a cut file, and the report as it is committed |
| conformance, of others' decoders and of WebAssembly | tools, vectors | one vector each |
| makers of vectors | vectors | three vectors come out the same |
| batches | tools, slow | a worker in this process codes one clip |
| loader for three.js, GPU form, pages, galleries | web, browser | one file each |
| decoder in WebAssembly, of the package and of the page | web, programs | both are what the C core makes |
| plugin for USD, player in raylib | programs | their calls have the arguments that the headers declare |
| release for other machines, media type | programs | a file of the core is read as for another; the first bytes |

Other tests of the tier `programs` build nothing of ours: they give files to Blender, VTK and programs from npm. Makers
of clips that need Helios, Blender, MuJoCo, CPlantBox, skeletor or scikit-fem run nowhere in the tests, but by
`python -m bench data` with `athcodec[bench-clips]`.
"""

from __future__ import annotations

import base64
import json
import re
import runpy
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from fuzz import seeds, sources, targets
from programs import install_once, printed

import athcodec
from athcodec.gpu import GpuFile
from athcodec.gpu.evaluate import Passes, Source
from athcodec.viewer import view
from athcodec.viewer.build_decoder import PAYLOAD
from bench import codec_registry, odd, report
from bench import codecs as bench_codecs
from bench.codecs import coder
from bench.store import read
from spec import conformance, robustness
from spec.robust import hostile, load

ROOT = Path(__file__).resolve().parent.parent
CORE = ROOT / "athcodec" / "core"
BOUND = 1e-3  # over the diagonal


@pytest.fixture(scope="module", autouse=True)
def quick_compiler():
    """Little optimisation, which changes no bit of what is coded: it takes most of the time of a build."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(coder, "OPTIMISATION", "-O1")
        coder.library.cache_clear()
        yield
    coder.library.cache_clear()


@pytest.fixture(scope="module")
def small_clip():
    """A trunk of four vertices with a branch of two that sway for six frames."""
    rest = np.array([[0, 0, 0], [0, 1, 0], [0, 2, 0], [0, 3, 0], [1, 2, 0], [2, 2, 0]], np.float32)
    sway = np.sin(np.arange(6))[:, None, None] * rest[:, 1:2] * np.array([0.1, 0, 0.05])
    return athcodec.MotionClip(
        positions=(rest + sway).astype(np.float32),
        time=np.arange(6) / 24,
        vertex_branch=np.array([0, 0, 0, 0, 1, 1]),
        branch_parent=np.array([-1, 0]),
        rest=rest,
        edges=np.array([[0, 1], [1, 2], [2, 3], [2, 4], [4, 5]], np.uint16),
        metadata={"unit": "m", "up_axis": "y"},
    )


@pytest.fixture(scope="module")
def small_file(small_clip, tmp_path_factory):
    path = tmp_path_factory.mktemp("smoke") / "small.h5"
    athcodec.write_hdf5(small_clip, path)
    return path


@pytest.fixture(scope="module")
def small_ath(small_clip, tmp_path_factory):
    path = tmp_path_factory.mktemp("smoke") / "small.ath"
    athcodec.encode(small_clip, path, rel_error=BOUND)
    return path


@pytest.fixture(scope="module")
def core_object(built_once):
    """The decoder with its GPU form as one object, made of the file that amalgamate.py writes."""
    text, made = (built_once / "core" / name for name in ("ath.c", "ath.o"))

    def build() -> None:
        printed(sys.executable, CORE / "amalgamate.py", "--gpu", text)
        coder.compile_c(made, [text], "-DATH_STATIC", "-O0", "-c")

    install_once(made.parent, made.name, build)
    return made


def built(folder: Path, sources: list[Path], *options: str) -> Path:
    """A program that is linked with the decoder."""
    program = folder / sources[0].stem
    coder.compile_c(program, sources, "-DATH_STATIC", "-O0", "-pthread", *options)
    return program


# ---- the benchmark ----


@pytest.mark.parametrize("codec", list(codec_registry.all_codecs()), ids=lambda codec: codec.name)
def test_every_codec_of_the_benchmark_builds_and_keeps_its_bound(codec, small_clip, monkeypatch):
    monkeypatch.setattr("bench.codecs.baseline.Baseline.rounds", 1)
    assert codec.missing() is None
    source = bench_codecs.Source(small_clip)
    bound = 0.0 if codec_registry.is_lossless(codec) else BOUND * source.diagonal
    data, _ = bench_codecs.check(codec, source, bound)
    assert 0 < len(data)


def test_a_call_that_no_longer_fits_the_core_ends_the_build_with_the_line_of_the_compiler(tmp_path):
    source = tmp_path / "late.c"
    source.write_text('#include "ath.h"\nint late(void *file) { return ath_read_rest(0, file, 0); }\n')
    with pytest.raises(SystemExit, match=r"late\.c: .*late\.c:2:\d+: error: too many arguments"):
        coder.compile_c(tmp_path / "late.so", [source], "-shared", "-fPIC")
    source.write_text('#include "ath.h"\nint late(double *rest) { return ath_read_rest(rest, 0); }\n')
    with pytest.raises(SystemExit, match=r"late\.c:2:\d+: error: .*incompatible"):
        coder.compile_c(tmp_path / "late.so", [source], "-shared", "-fPIC")


RUNS = {  # Words of each verb after a clip, or alone.
    "rd": "CLIP --bounds 1e-3 --codecs RAW",
    "report": "--help",
    "engines": "--help",
    "sample": "--help",
    "viewer": "--help",
    "gallery": "--help",
    "data": "vertex",
    "sizes": "CLIP --rel-error 1e-3",
    "features": "CLIP --bounds 1e-3 --features rotations --results OUT",
    "levels": "CLIP",
    "progressive": "CLIP --rel-error 9e-2",
    "speed": "CLIP",
    "memory": "--help",
    "decode": "CLIP --rounds 1 --seeks 1",
    "picture": "CLIP --out OUT",
    "wrappings": "--help",
    "onto": "--picture OUT",
    "structure": "hedge_stems --short",
    "pairs": "CLIP+CLIP --rel-error 1e-2 --results OUT",
    "split": "--help",
    "branches": "CLIP --results OUT",
    "constants": "CLIP --modules learned_modes --frames 4 --rel-error 1e-2 --results OUT",
    "effort": "--learning CLIP --judging CLIP --rel-error 1e-2 --results OUT",
}


@pytest.mark.parametrize("verb", RUNS)
def test_every_verb_of_the_benchmark_runs(verb, core_object, small_file, tmp_path, monkeypatch, capsys):
    from bench import decode
    from bench.__main__ import VERBS, main  # here, because what all verbs need takes long to import
    from bench.scenes import SCENES, Recipe, fields

    assert RUNS.keys() == VERBS.keys()
    monkeypatch.setattr(decode, "compile_program", lambda folder: built(folder, [decode.SOURCE, core_object]))
    monkeypatch.setenv("ATHCODEC_BENCH_DATA", str(tmp_path))
    monkeypatch.setitem(SCENES, "hedge_stems", Recipe("two shrubs", fields.stems, {"seed": 3, "plants": 2}))
    own = {"CLIP": str(small_file), "OUT": str(tmp_path / "out"), "RAW": "simple (differences, zstd)"}
    words = ["+".join(own.get(part, part) for part in word.split("+")) for word in RUNS[verb].split()]
    if words == ["--help"]:
        with pytest.raises(SystemExit) as ended:
            main([verb, *words])
        assert ended.value.code == 0
    else:
        assert main([verb, *words]) == 0
    assert verb in capsys.readouterr().out


def test_makers_of_clips_that_need_no_other_program_make_them(tmp_path, monkeypatch):
    from bench.data import Canopy
    from bench.foreign import lsystem, shader

    canopy = Canopy(nodes=40, orders=2, frames=3, height=3.0, wind_speed=8.0, leaves=12, species="broadleaf", seed=1)
    assert all(clip.frame_count > 1 for clip in (canopy.make(), odd.CLIPS["cube"].make(), odd.CLIPS["vertex"].make()))
    monkeypatch.setattr(lsystem, "FRAMES", 3)
    lsystem.sequence(tmp_path / "herb_0000.ply", plant="herb", seed=1)
    shader.morphs(tmp_path / "cards.glb", seed=1, nodes=30, orders=2, height=2.0, frames=3)
    for name in ("herb_0000.ply", "cards.glb"):
        with athcodec.read(tmp_path / name) as clip:
            assert clip.frame_count == 3 and np.ptp(clip.block(0, 3), axis=0).max() > 0, name


def test_the_tables_of_documents_are_those_of_the_stored_results():
    for document, name, text in report.sections():
        assert report.parted(document.read_text("utf-8"), name)[1] == f"\n{text}\n", name


def test_every_stored_result_names_a_commit():
    for file in sorted((ROOT / "bench" / "results").glob("*.json")):
        contents = read(file)
        rows = [row for table in contents.values() if isinstance(table, list) for row in table if "command" in row]
        assert all(re.search(r"[0-9a-f]{8}", result["commit"]) for result in [contents, *rows]), file.name


# ---- programs in C ----


@pytest.mark.parametrize("target", targets.TARGETS)
def test_every_fuzz_target_builds_and_tries_a_file(target, core_object, small_ath, tmp_path):
    mine = [targets.HERE / f"{name}.c" for name in (target, "harness", "replay")]
    program = built(tmp_path, [*mine, core_object], f"-I{targets.HERE}")
    (tmp_path / "seed").write_bytes(small_ath.read_bytes() + bytes(seeds.OPTIONS))
    outcome = targets.replay(target, program, [tmp_path / "seed"])
    assert outcome.kind == "" and outcome.log == ""


def test_the_mutator_of_fuzzing_builds(tmp_path):
    coder.compile_c(tmp_path / "a.o", [targets.HERE / "mutator.c"], "-DATH_STATIC", "-O0", f"-I{targets.HERE}", "-c")


def test_the_program_for_other_machines_decodes_a_vector_here(core_object, tmp_path):
    program = built(tmp_path, [ROOT / "tests" / "machines.c", core_object])
    [vector] = [vector for vector in conformance.vectors() if vector.name == "valid/smallest.ath"]
    path, *results = printed(program, input=f"{vector.path}\n").split()
    assert path == str(vector.path) and set(results) <= {f"{item}={crc}" for item, crc in vector.results.items()}
    assert len(results) > 2


def test_the_program_of_many_threads_sees_what_one_alone_does(core_object, small_ath, tmp_path):
    program = built(tmp_path, [load.HERE / "threads.c", core_object])
    row = load.threads_in_c(program, [small_ath], threads=2, rounds=1)
    assert row.tried > 0 and row.faults == 0


@pytest.mark.parametrize("name", ["faulty", "scarce"])
def test_libraries_whose_calls_fail_build(name, tmp_path):
    coder.compile_c(tmp_path / "a.so", [load.HERE / f"{name}.c"], "-O0", "-shared", "-fPIC", "-ldl")


# ---- hostile input ----


@pytest.mark.parametrize("kind", sources.KINDS)
def test_readers_are_given_a_seed_of_their_kind(kind, tmp_path):
    assert any(sources.attempt(kind, data, tmp_path) for data in sources.seeds(kind))


def test_a_hostile_file_is_refused_and_a_whole_one_plays_within_limits(small_ath):
    data = small_ath.read_bytes()
    assert hostile.prefix_strictly(data, len(data) // 2) == hostile.prefix_as_a_stream(data, len(data) // 2) == 0
    assert hostile.too_long(data, b"more") == 0
    assert hostile.within_limits(hostile.repaired(data)) > 0


def test_the_time_of_a_file_is_measured_beside_what_its_counts_determine(small_ath):
    seconds, size = hostile.seconds_and_bytes(small_ath.read_bytes())
    with athcodec.open(small_ath) as decoder:
        assert seconds > 0 and size > small_ath.stat().st_size + decoder.positions().nbytes


def test_the_report_on_robustness_is_that_of_its_record():
    spec = ROOT / "spec"
    record = json.loads((spec / "robustness.json").read_text("utf-8"))
    assert robustness.as_markdown(record) == (spec / "robustness.md").read_text("utf-8")
    assert set(record) == set(robustness.classes())


# ---- the format ----


@pytest.mark.parametrize("name", ["document", "wasm"])
def test_decoders_that_are_asked_by_later_tiers_alone_answer_as_a_vector_expects(name):
    program = conformance.command([sys.executable, str(ROOT / "spec" / "document.py")])
    decoder = {"document": program, "wasm": conformance.OWN["wasm"].decoder}[name]
    [vector] = [vector for vector in conformance.vectors() if vector.name == "invalid/time-equal.ath"]
    assert list(conformance.failures(decoder, [vector], ["strict"])) == []


def test_makers_of_vectors_make_the_same_files_again():
    from spec import make  # here, because the scripts of all vectors are read

    known = {vector.name: vector for vector in make.VECTORS if vector.scripted}
    for name in ("smallest", "clips-two", "layers-three"):
        assert known[name].make() == (conformance.FOLDER / known[name].path).read_bytes(), name


# ---- what plays files elsewhere ----


def test_the_decoders_in_webassembly_are_made_of_the_core_as_it_is():
    """An older one refuses files that the package writes, and nothing else would tell."""
    viewer = ROOT / "athcodec" / "viewer"
    printed(sys.executable, viewer / "build_decoder.py", "--check")
    decoder, worker = ((viewer / name).read_text("utf-8") for name in ("ath_decoder.mjs", "web/ath_worker.js"))
    packed = PAYLOAD.search(decoder)[2]
    assert len(packed) > 50_000
    assert packed in worker, "run python athcodec/viewer/build_viewer.py"


def test_the_loader_of_three_shows_what_was_asked_for_last(layered_ath):
    cases = ROOT / "tests" / "node" / "loader_cases.mjs"
    assert json.loads(printed("node", "--no-warnings", "--expose-gc", cases, "overtaken", layered_ath)) is True


def test_positions_follow_from_the_blocks_of_the_gpu_form(small_ath):
    gpu = GpuFile(small_ath.read_bytes())
    level = gpu.core.info.level_count - 1
    coded = np.array([gpu.coded_frame(frame) for frame in range(gpu.core.info.frame_count)])
    shown = Passes(gpu.level(level), Source(gpu.segment(0, level), coded)).vertices()
    with athcodec.open(small_ath) as decoder:
        np.testing.assert_allclose(shown, decoder.positions(), rtol=0, atol=1e-4)


def test_pages_and_frames_of_notebooks_hold_the_files_that_they_show(small_ath, tmp_path):
    view.export_page(small_ath, tmp_path / "page.html")
    page, front = (tmp_path / "page.html").read_text("utf-8"), base64.b64encode(small_ath.read_bytes()[:30]).decode()
    assert front in page and '<noscript><div id="no-script"><svg' in page
    with athcodec.open(small_ath) as decoder:
        frame = decoder.show(height=300)
        assert 'sandbox="allow-scripts"' in frame._repr_html_() and 'height="300"' in frame._repr_html_()
        assert front in frame._repr_html_() and frame._repr_html_() == athcodec.Frame(decoder, 300)._repr_html_()
        assert frame._repr_html_()[:40] in decoder._repr_html_()


def test_a_worker_in_this_process_encodes_a_batch(small_file, tmp_path):
    import distributed  # here, because it takes long to import

    from athcodec import batch

    items = batch.find([small_file], tmp_path / "out", settings={"effort": "fast"})
    with distributed.LocalCluster(processes=False, n_workers=1, dashboard_address=None) as cluster:
        outcome = batch.run(items, tmp_path / "out", scheduler=cluster.scheduler_address)
    assert len(outcome.done) == 1 and (tmp_path / "out" / "small.ath").exists()


def arguments(text: str, start: int) -> int:
    """How many arguments, or parameters, stand between the bracket at `start` and the one that closes it."""
    depth, count = 0, 1
    for at in range(start, len(text)):
        depth += (text[at] in "([{") - (text[at] in ")]}")
        count += text[at] == "," and depth == 1
        if depth == 0:
            return 0 if text[start + 1 : at].strip() in ("", "void") else count
    raise ValueError(f"brackets: got none that closes the one at {start}")


def calls(path: Path) -> set[tuple[str, int]]:
    """Functions of the core that a file names before a bracket, with their number of arguments."""
    text = re.sub(r"/\*.*?\*/|//[^\n]*", "", path.read_text("utf-8"), flags=re.DOTALL)
    return {(found[1], arguments(text, found.end() - 1)) for found in re.finditer(r"\b(ath_\w+)\(", text)}


@pytest.mark.parametrize("place", ["usd/src/*", "core/examples/raylib_player.c"])
def test_what_is_built_on_the_core_elsewhere_calls_functions_with_the_arguments_that_headers_declare(place):
    declared = {call for name in ("ath.h", "ath_player.h") for call in calls(CORE / "include" / name)}
    called = {call for path in (ROOT / "athcodec").glob(place) for call in calls(path)}
    assert len(called) > 12 and called <= declared, called - declared


def test_the_builder_of_releases_compiles_the_whole_core_and_looks_for_files_that_are_there(tmp_path):
    release = runpy.run_path(str(ROOT / ".ci" / "release"))
    recipe = release["recipe"](tmp_path)
    assert {CORE / word for word in recipe if word.endswith(".c")} >= set(targets.decoder_sources())
    assert "-ffp-contract=off" in recipe and "-O3" in recipe
    options, one = [word for word in recipe if not word.endswith(".c")], CORE / "container" / "container.c"
    compiler = sys.executable, "-m", "ziglang", "cc", "-target", "aarch64-linux-gnu"
    release["run"](*compiler, *options, "-O0", "-c", one, "-o", tmp_path / "container.o")
    assert all((ROOT / "athcodec" / name).exists() for name in release["HELD"])
    # The file for pkg-config and the one for find_package take their version from here.
    assert (
        f"CMAKE_PROJECT_VERSION:STATIC={athcodec.__version__}\n" in (tmp_path / "cmake" / "CMakeCache.txt").read_text()
    )


def test_the_media_type_is_known_by_the_first_bytes_of_a_file(small_ath):
    first = small_ath.read_bytes()[:8].decode("latin-1").encode("unicode_escape").decode()
    folder = ROOT / "spec" / "media-type"
    [match] = ElementTree.parse(folder / "athcodec.xml").iterfind(".//{*}match")
    assert match.get("value") == first and f"string\t{first}\t" in (folder / "ath.magic").read_text("utf-8")
