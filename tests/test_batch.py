"""Batches: every clip is encoded once, completely and to the bytes of a single encoding, whatever process dies, disk
fills up or input is broken."""

from __future__ import annotations

import functools
import http.server
import json
import os
import re
import resource
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import distributed
import fsspec
import numpy as np
import psutil
import pytest
from plants import plant
from programs import printed

import athcodec
from athcodec import batch, cli
from athcodec.batch import manifest, runs
from athcodec.batch.manifest import Manifest, ManifestError
from athcodec.decoding.container import MAGIC
from athcodec.errors import ClipError, MissingExtra

pytestmark = pytest.mark.tools

FAST = {"effort": "fast", "segment_frames": 16}
BATCH = [sys.executable, "-m", "athcodec", "batch"]
WORDS = ["--effort", "fast", "--segment-frames", "16"]


@pytest.fixture(scope="module")
def cluster():
    """The address of a scheduler with two workers, processes, that some tests share."""
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0") as cluster:
        yield cluster.scheduler_address


@pytest.fixture
def clips(tmp_path):
    """A folder with three short clips, one of them in a folder of its own, and a long one of 13 segments."""
    folder = tmp_path / "in"
    (folder / "sub").mkdir(parents=True)
    for name, frames in (("a", 20), ("b", 40), ("sub/c", 20), ("long", 200)):
        athcodec.write_hdf5(plant(seed=frames, branches=5, longest=4, frames=frames), folder / f"{name}.h5")
    return folder


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out"


def alone(path: Path, **options) -> bytes:
    with athcodec.read(path) as clip:
        return athcodec.encode(clip, **options)


def lines(out: Path) -> list[dict]:
    return [json.loads(line) for line in (out / runs.MANIFEST).read_text().splitlines()]


def done_once(out: Path) -> set[str]:
    """Outputs that have one line that they are done; each is checked against its file."""
    done = [line for line in lines(out) if line["status"] == "done"]
    assert len({line["output"] for line in done}) == len(done)
    for line in done:
        with athcodec.open(out / line["output"], strict=True) as decoder:
            decoder.file.check()
        assert batch.inputs.sha256(out / line["output"]) == line["sha256"]
    return {line["output"] for line in done}


def leftovers(out: Path) -> list[Path]:
    return [path for path in out.rglob("*") if path.name.endswith(".part")]


# ---- what comes out ----


def test_files_are_those_that_encode_writes_also_of_clips_that_workers_share(clips, cluster, out):
    items = batch.find([clips], out, settings=FAST)
    outcome = batch.run(items, out, scheduler=cluster, split=3, verify=True)
    assert len(outcome.done) == 4 and not outcome.failed and not leftovers(out)
    for item in items:
        assert Path(item.output).read_bytes() == alone(Path(item.input), **FAST), item.name
    assert done_once(out) == {"a.ath", "b.ath", "long.ath", "sub/c.ath"}


@pytest.mark.parametrize(
    "settings",
    [{"lossless": True}, {"target_size": "9kB"}, {"weights": "radius"}, {"max_error": "1mm", "tam": "1mm,2,1cm,3"}],
    ids=str,
)
def test_a_long_clip_is_the_same_under_settings_of_all_kinds(settings, tmp_path, cluster, sample_file):
    items = batch.find([sample_file], tmp_path / "out", settings=settings | FAST)
    [record] = batch.run(items, tmp_path / "out", scheduler=cluster, split=2).done
    options = batch.settings.coding_options(items[0].settings)
    assert Path(items[0].output).read_bytes() == alone(sample_file, **options)
    assert record["bytes"] == Path(items[0].output).stat().st_size


def test_clips_become_loops_by_pattern_and_by_option(clips, tmp_path, cluster):
    out, settings = tmp_path / "out", tmp_path / "s.toml"
    settings.write_text('["a.h5"]\nloop = false\n["sub/*"]\nloop = true\nloop_blend = 0\n')
    words = ["batch", str(clips), "--out", str(out), "--settings", str(settings), "--scheduler", cluster, *WORDS]
    assert cli.main([*words, "--split", "3", "--loop-blend", "5"]) == 0
    found = {}
    for name in ("a", "b", "sub/c", "long"):
        with athcodec.open(out / f"{name}.ath", strict=True) as decoder:
            found[name] = decoder.clip.loop, decoder.frame_count
    assert found == {"a": (False, 20), "b": (True, 35), "sub/c": (True, 20), "long": (True, 195)}
    with athcodec.read(clips / "long.h5") as clip:
        assert (out / "long.ath").read_bytes() == athcodec.encode(athcodec.looped(clip, 5), **FAST)
    assert cli.main([*words, "--loop-blend", "5"]) == 0 and len(done_once(out)) == 4, "nothing is done again"
    assert cli.main([*words, "--loop"]) == 0
    with athcodec.open(out / "b.ath") as decoder:
        assert (decoder.clip.loop, decoder.frame_count) == (True, 40)


def test_a_blend_that_is_too_long_for_a_clip_is_reported(clips, tmp_path, cluster, capsys):
    words = ["batch", str(clips / "a.h5"), "--out", str(tmp_path / "out"), "--scheduler", cluster]
    assert cli.main([*words, "--loop-blend", "7"]) == 1
    assert "loop: got 7 frames to blend, expected 0 to 6" in capsys.readouterr().err


def test_a_line_of_the_manifest_says_what_was_made_of_what(clips, cluster, out):
    items = batch.find([clips / "a.h5"], out, settings=FAST)
    batch.run(items, out, scheduler=cluster)
    [line] = lines(out)
    stat = (clips / "a.h5").stat()
    assert (line["input"], line["output"], line["settings"]) == (str(clips / "a.h5"), "a.ath", FAST)
    assert line["source"] == {"size": stat.st_size, "mtime_ns": stat.st_mtime_ns}
    assert line["version"] == athcodec.__version__ and line["bytes"] == (out / "a.ath").stat().st_size
    assert 0 < line["rms_error"] < line["max_error"] <= line["max_error_bound"]


# ---- what is done again ----


def reasons(items, out) -> dict[str, str]:
    return {forecast.item.name: forecast.reason for forecast in batch.preview(items, out)}


def test_what_is_not_read_of_a_clip_is_in_its_line_and_said(tmp_path, cluster, capsys):
    for frame in range(2):
        text = f"v 0 0 0\nv 1 0 {frame}\nv 0 1 0\ncurv 0 1 1 2 3\nf 1 2 3\n"
        (tmp_path / f"a_{frame}.obj").write_text(text)
    words = ["batch", str(tmp_path / "a_0.obj"), "--out", str(tmp_path / "out"), "--scheduler", cluster]
    assert cli.main(words) == 0
    [line] = lines(tmp_path / "out")
    assert line["not_read"] == "curve or surface curv"
    assert "a_0.obj: curve or surface curv" in capsys.readouterr().err


def test_a_second_run_does_only_what_is_not_as_it_should_be(clips, cluster, out):
    items = batch.find([clips], out, settings=FAST)
    batch.run(items, out, scheduler=cluster)
    before = (out / runs.MANIFEST).read_bytes()
    outcome = batch.run(items, out, scheduler="tcp://127.0.0.1:1")  # nobody there, and nobody needed
    assert not outcome.done and len(outcome.kept) == 4 and (out / runs.MANIFEST).read_bytes() == before

    data = bytearray((out / "a.ath").read_bytes())
    data[-1] ^= 1
    (out / "a.ath").write_bytes(data)
    (out / "long.ath").unlink()
    os.utime(clips / "b.h5", ns=(0, 0))
    items = batch.find([clips], out, settings=FAST, patterns={"sub/*": {"rel_error": 1e-3}})
    assert reasons(items, out) == {
        "a.h5": "output was changed",
        "long.h5": "output is missing",
        "b.h5": "other input",
        "sub/c.h5": "other settings",
    }
    assert len(batch.run(items, out, scheduler=cluster).done) == 4
    assert set(reasons(items, out).values()) == {""} and len(lines(out)) == 8
    assert (out / "sub/c.ath").read_bytes() == alone(clips / "sub/c.h5", rel_error=1e-3, **FAST)


def test_an_output_directory_may_be_moved_with_its_manifest(clips, tmp_path, cluster):
    batch.run(batch.find([clips / "a.h5"], tmp_path / "out"), tmp_path / "out", scheduler=cluster)
    (tmp_path / "out").rename(tmp_path / "there")
    assert reasons(batch.find([clips / "a.h5"], tmp_path / "there"), tmp_path / "there") == {"a.h5": ""}


@pytest.mark.parametrize("cut", [1, 10, 11, 60, 10_000])
def test_an_incomplete_last_line_is_removed_and_its_clip_encoded_again(cut, tmp_path):
    path = tmp_path / "m.jsonl"
    with Manifest(path) as notes:
        notes.add({"output": "a", "status": "done"})
        whole = path.read_bytes()
        notes.add({"output": "b", "status": "done", "reason": "long " * 30})
    path.write_bytes(path.read_bytes()[: max(len(whole), path.stat().st_size - cut)])
    assert manifest.read_records(path).keys() == {"a"}
    with Manifest(path) as notes:
        assert notes.records.keys() == {"a"} and path.read_bytes() == whole
        notes.add({"output": "c", "status": "done"})
    assert manifest.read_records(path).keys() == {"a", "c"}


@pytest.mark.parametrize("rest", [b"\0" * 50, b"\0" * 50 + b"\n", b'{"outp', b'{"output": "b", "st\n'])
def test_zeros_and_half_lines_at_the_end_of_a_manifest_are_removed(rest, tmp_path):
    path = tmp_path / "m.jsonl"
    path.write_bytes(b'{"output": "a", "status": "done"}\n' + rest)
    with Manifest(path) as notes:
        assert notes.records.keys() == {"a"}
    assert path.read_bytes() == b'{"output": "a", "status": "done"}\n'


NO_MANIFESTS = [b"[1, 2]", b'{"name": "package"}', b"text\nmore\n", b'{"output": 3}\n{}\n']


@pytest.mark.parametrize("content", [*NO_MANIFESTS, b'{"output": "a"}\nnotes\n{"output": "b"}\n'])
def test_a_file_that_is_no_manifest_is_refused_and_left_alone(content, tmp_path):
    path = tmp_path / "notes.txt"
    path.write_bytes(content)
    with pytest.raises(ManifestError, match="notes.txt: line . is no line of a manifest"):
        Manifest(path)
    assert path.read_bytes() == content


def test_two_runs_on_one_manifest_are_refused(clips, capsys, out):
    out.mkdir()
    with Manifest(out / runs.MANIFEST):
        assert cli.main(["batch", str(clips), "--out", str(out)]) == 1
        assert "another run has this manifest open" in capsys.readouterr().err
    assert [path.name for path in out.iterdir()] == [runs.MANIFEST]


def test_a_dry_run_lists_what_would_be_done_and_writes_nothing(clips, tmp_path, capsys):
    assert cli.main(["batch", str(clips), "--out", str(tmp_path / "out"), "--dry-run", "--max-error", "1mm"]) == 0
    out = capsys.readouterr().out
    assert "sub/c.h5" in out and "max_error=1mm" in out and "4 clips of 4 to do" in out
    assert not (tmp_path / "out").exists()


ASK_WORKER = """
import os
from distributed import Client
from athcodec.batch.runs import _cluster
if __name__ == "__main__":
    with _cluster(1) as cluster, Client(cluster) as client:
        print(cluster.scheduler_address.split(":")[0], client.submit(os.getenv, "MALLOC_TRIM_THRESHOLD_").result())
"""


@pytest.mark.slow
def test_workers_keep_the_memory_of_their_arrays_and_are_reached_with_a_key(tmp_path):
    """By itself Dask has them give it back at once, and encoding takes twice the time."""
    (tmp_path / "ask.py").write_text(ASK_WORKER)
    assert printed(sys.executable, tmp_path / "ask.py") == "tls None\n"


# ---- inputs and settings ----


def names(*inputs, out="out") -> list[str]:
    return [item.name for item in batch.find(inputs, out)]


def test_inputs_are_files_folders_and_patterns(clips, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (clips / "notes.txt").touch()
    (clips / "frame_01.obj").touch()
    assert names("in") == names("in/**/*.h5") == ["a.h5", "b.h5", "long.h5", "sub/c.h5"]
    assert names("in/sub", "in/a.h5") == ["a.h5", "c.h5"]
    assert names("in/[ab].h5", "in/a.h5") == ["a.h5", "b.h5"]
    for series in ("in/frame_##.obj", "in/frame_%02d.obj"):
        assert batch.find([series], "out")[0].output == str(tmp_path / "out" / "frame.ath")


def test_inputs_can_come_from_a_list(clips, tmp_path, monkeypatch, capsys):
    (tmp_path / "list.txt").write_text(f"{clips}/a.h5\n\n{clips}/b.h5\n")
    words = ["batch", "--list", str(tmp_path / "list.txt"), "--out", str(tmp_path / "out"), "--dry-run", "--json"]
    assert cli.main(words) == 0
    found = json.loads(capsys.readouterr().out)["clips"]
    assert [entry["input"] for entry in found] == [f"{clips}/a.h5", f"{clips}/b.h5"]


def test_file_names_that_are_not_utf8_are_encoded_and_recognised(clips, cluster, out):
    name = os.fsdecode(b"b\xe4um.h5")
    (clips / "a.h5").rename(clips / name)
    items = batch.find([clips / name], out, settings=FAST)
    assert len(batch.run(items, out, scheduler=cluster, split=1).done) == 1 and done_once(out)
    assert reasons(items, out) == {name: ""}


def test_inputs_that_name_nothing_or_one_output_twice_are_refused(clips, tmp_path):
    (clips / "a.npz").touch()
    for wrong, message in (
        ([clips / "none.h5"], "none.h5"),
        ([clips / "*.abc"], "got no clips"),
        ([clips], "expected a name of its own"),
    ):
        with pytest.raises((ClipError, FileNotFoundError), match=message):
            batch.find(wrong, tmp_path / "out")


def test_later_patterns_win_and_their_bound_takes_the_place_of_another(tmp_path):
    (tmp_path / "s.toml").write_text(
        '["*"]\nrel_error = 1e-3\neffort = "fast"\n["sub/*"]\nmax_error = "1 mm"\n'
        '["*.npz"]\nmesh = "m.obj"\nfps = "24000/1001"\n'
    )
    patterns = batch.load_settings(tmp_path / "s.toml")
    of = functools.partial(batch.settings.settings_of, default={"lossless": True, "effort": "best"}, patterns=patterns)
    assert of(("a.h5",)) == {"lossless": True, "rel_error": 1e-3, "effort": "fast"}
    assert of(("sub/b.h5",)) == {"lossless": True, "max_error": "1 mm", "effort": "fast"}
    assert of(("c.npz",))["mesh"] == str(tmp_path / "m.obj") and of(("c.npz",))["fps"] == 24000 / 1001


@pytest.mark.parametrize(
    "text, message",
    [
        ("rel_error = 1e-4", "expected a table of settings under a pattern"),
        ('["*"]\nquality = 3', "unknown setting 'quality', expected one of max_error"),
        ('["*"]\nrel_error = 2', "rel_error: got 2"),
        ('["*"]\nmax_error = "1 mile"', "max_error: got '1 mile'"),
        ('["*"]\neffort = "much"', "expected one of fast"),
        ('["*"]\nlossless = 1', "expected true or false"),
        ('["*"]\nsegment_frames = 8', "expected a whole number, 16 to"),
        ('["*"]\ntam = [1, 2]', "expected four values"),
        ('["*"]\nsource_format = "zip"', "source_format: got 'zip'"),
        ('["*"', "got no TOML"),
        ('["*"]\nrel_error = 1e-3\nmax_error = 1', "expected one of them"),
        ('["*"]\nloop = "yes"', "expected true or"),
        ('["*"]\nloop_blend = -1', "expected a whole number, 0 to"),
        ('["*"]\ntakes = [1]', "expected a pattern or a"),
    ],
)
def test_settings_that_do_not_exist_or_make_no_sense_are_refused_by_name(text, message, tmp_path, capsys, clips):
    (tmp_path / "s.toml").write_text(text)
    words = ["batch", str(clips), "--out", str(tmp_path / "out"), "--settings", str(tmp_path / "s.toml")]
    assert cli.main(words) == 1
    err = capsys.readouterr().err
    assert message in err and "s.toml" in err and err.count("\n") == 1
    assert not (tmp_path / "out").exists()


class Quiet(http.server.SimpleHTTPRequestHandler):
    unsaid = ""  # a header that is left out

    def log_message(self, *_) -> None:
        pass

    def send_header(self, name: str, value: str) -> None:
        if name != self.unsaid:
            super().send_header(name, value)


@pytest.fixture
def served(clips):
    """The URL of the clips."""
    handler = functools.partial(Quiet, directory=str(clips))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


def test_inputs_behind_urls_are_fetched_and_known_again(clips, served, cluster, out):
    urls = [f"{served}/a.h5", f"{served}/long.h5", f"file://{clips}/sub/*.h5", f"{served}/none.h5"]
    items = batch.find(urls, out, settings=FAST)
    outcome = batch.run(items, out, scheduler=cluster)
    assert [record["output"] for record in outcome.failed] == ["none.ath"] and "none.h5" in outcome.failed[0]["reason"]
    for name in ("a", "long", "sub/c"):
        assert (out / f"{Path(name).name}.ath").read_bytes() == alone(clips / f"{name}.h5", **FAST)
    assert not leftovers(out)
    os.utime(clips / "a.h5", ns=(0, 0))  # Last-Modified
    assert reasons(items, out) == {"a.h5": "other input", "long.h5": "", "c.h5": "", "none.h5": "failed before"}


def test_an_input_without_a_modification_time_is_known_by_its_content(clips, served, cluster, monkeypatch, out):
    monkeypatch.setattr(Quiet, "unsaid", "Last-Modified")
    items = batch.find([f"{served}/a.h5"], out, settings=FAST)
    [record] = batch.run(items, out, scheduler=cluster).done
    assert record["source"] == {"size": (clips / "a.h5").stat().st_size, "sha256": batch.inputs.sha256(clips / "a.h5")}
    outcome = batch.run(items, out, scheduler=cluster)
    assert outcome.kept == items and not outcome.done and len(lines(out)) == 1
    with open(clips / "a.h5", "r+b") as file:  # of the same size
        file.seek(-1, os.SEEK_END)
        file.write(b"!")
    assert len(batch.run(items, out, scheduler=cluster).done) == 1


# ---- object stores ----


def test_clips_in_an_object_store_become_files_there_and_a_second_run_does_what_is_missing(clips, s3, tmp_path):
    url = s3.put({f"in/{path.relative_to(clips)}": path.read_bytes() for path in clips.rglob("*.h5")})
    notes, store = tmp_path / "notes" / "n.jsonl", s3.system()

    def run() -> tuple[int, int]:
        words = [f"{url}/in/**/*.h5", "--out", f"{url}/out", "--manifest", str(notes), "--split", "3", "--verify"]
        result = json.loads(printed(*BATCH, *words, *WORDS, "--workers", "2", "--json"))
        return result["done"], result["kept"]

    assert run() == (4, 0)
    names = {f"plants/out/{name}.ath" for name in ("a", "b", "long", "sub/c")}
    assert set(store.find("plants/out")) == names
    for name in ("a", "long", "sub/c"):
        assert store.cat_file(f"plants/out/{name}.ath") == alone(clips / f"{name}.h5", **FAST)
    assert [path.name for path in notes.parent.iterdir()] == ["n.jsonl"]
    assert run() == (0, 4)
    store.rm_file("plants/out/a.ath")
    store.pipe_file("plants/out/b.ath", MAGIC + b"something else")
    store.put_file(str(clips / "a.h5"), "plants/in/sub/c.h5")
    assert run() == (3, 1) and run() == (0, 4)
    assert store.cat_file("plants/out/sub/c.ath") == store.cat_file("plants/out/a.ath")


def test_what_is_no_ath_file_in_an_object_store_stays(clips, s3, tmp_path):
    url, store = s3.put({"out/a.ath": b"something else"}), s3.system()
    words = [str(clips / "a.h5"), "--out", f"{url}/out", "--manifest", str(tmp_path / "n.jsonl"), "--workers", "1"]
    done = subprocess.run([*BATCH, *words, *WORDS], capture_output=True, text=True, timeout=120)
    assert done.returncode == 1 and "a.ath: is there already and no .ath file" in done.stderr
    assert store.cat_file("plants/out/a.ath") == b"something else"


def test_clips_in_an_object_store_become_local_files(clips, s3, tmp_path):
    url = s3.put({f"in/{name}.h5": (clips / f"{name}.h5").read_bytes() for name in ("a", "b")})
    code, err = finished(start(f"{url}/in/", tmp_path / "out"))
    assert code == 0 and done_once(tmp_path / "out") == {"a.ath", "b.ath"}, err


def test_memory_serves_workers_in_this_process_and_is_no_place_for_others(clips, tmp_path, cluster):
    memory = fsspec.filesystem("memory")
    for path in clips.rglob("*.h5"):
        memory.pipe(f"/in/{path.relative_to(clips)}", path.read_bytes())
    items = batch.find(["memory://in/**/*.h5"], "memory://out", settings=FAST)
    assert [item.name for item in items] == ["a.h5", "b.h5", "long.h5", "sub/c.h5"]
    with distributed.LocalCluster(processes=False, n_workers=1, dashboard_address="127.0.0.1:0") as here:
        outcome = batch.run(items, "memory://out", manifest=tmp_path / "here", scheduler=here.scheduler_address)
    assert len(outcome.done) == 4 and not outcome.failed
    assert memory.cat_file("/out/sub/c.ath") == alone(clips / "sub/c.h5", **FAST)
    items = batch.find([clips / "a.h5"], "memory://elsewhere", settings=FAST)
    outcome = batch.run(items, "memory://elsewhere", manifest=tmp_path / "there", scheduler=cluster)
    assert "workers need a file system that all share" in outcome.failed[0]["reason"]


@pytest.mark.parametrize(
    "out, message",
    [
        ("memory://out", "memory://out: got no manifest, expected a file of this machine where outputs go to a URL"),
        ("https://me:hush@example.org/out?key=hush", "https://example.org/out: got a chain of file systems or a query"),
    ],
)
def test_an_unusable_output_url_is_an_error_of_one_line(out, message, clips, capsys):
    assert cli.main(["batch", str(clips / "a.h5"), "--out", out]) == 1
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and message in err and "hush" not in err


# ---- what is shown ----


def test_each_clip_has_a_line_once_it_is_done_or_has_failed(clips, cluster, out):
    (clips / "b.h5").write_bytes(b"no clip")
    items, said = batch.find([clips / "a.h5", clips / "b.h5"], out, settings=FAST), []
    outcome = batch.run(items, out, scheduler=cluster, report=said.append)
    assert [re.match(r"\[([12])/2\] ([ab]\.h5): ", line)[1] for line in said] == ["1", "2"]
    done, failed = sorted(line.split(": ", 1)[1] for line in said)
    assert done.startswith(f"{outcome.done[0]['bytes']:,} bytes, ") and failed.startswith("failed: ")
    (out / "a.ath").unlink()
    (clips / "b.h5").unlink()
    batch.run(batch.find([clips], out, settings=FAST), out, scheduler=cluster, report=lambda line: None)
    batch.run([*batch.find([clips], out, settings=FAST), items[1]], out, scheduler=cluster, report=said.append)
    assert said[2] == "3 kept, 1 to do" and said[3].startswith("[1/1] b.h5: failed: ")


def test_warnings_of_workers_look_like_those_of_a_single_encoding(clips, out):
    """A worker is a process without a terminal, whose own warnings would name a file and a line of Python."""
    for name, frames in (("still", 1), ("sways", 40)):  # A clip that is encoded whole, and one whose segments are.
        np.savez(clips / f"{name}.npz", verts=plant(seed=frames, branches=5, longest=4, frames=frames).positions)
    words = [str(clips / "*.npz"), "--out", str(out), "--workers", "1", "--split", "1", *WORDS, "--rel-error", "0.3"]
    done = subprocess.run([*BATCH, *words], capture_output=True, text=True, timeout=600)
    warned = [line for line in done.stderr.splitlines() if "arning" in line]
    assert done.returncode == 0 and warned, done.stderr
    assert all(line.startswith(f"athcodec: warning: {clips}/s") for line in warned), done.stderr
    for name, text in (("still", "holds a single frame"), ("sways", "was taken for them")):
        assert sum(f"{name}.npz" in line and text in line for line in warned) == 1, done.stderr
    assert ".py:" not in done.stderr


@pytest.mark.parametrize("words", [("--still",), ("--settings",)])
def test_a_source_of_a_single_frame_can_be_meant(clips, out, words):
    """By the option of `encode` or by a setting, and a plain run sets nothing that nobody asked for."""
    np.savez(clips / "still.npz", verts=plant(seed=1, branches=5, longest=4, frames=1).positions)
    settings = clips / "settings.toml"
    settings.write_text('["still*"]\nstill = true\n')
    words = [*words, str(settings)] if words == ("--settings",) else words
    command = [*BATCH, str(clips / "*.npz"), "--out", str(out), "--workers", "1", *WORDS, *words]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0 and "holds a single frame" not in done.stderr, done.stderr
    planned = subprocess.run([*command, "--dry-run"], capture_output=True, text=True, timeout=600)
    assert "still=True" in planned.stdout and "allow_outside" not in planned.stdout


# ---- what goes wrong ----


def test_one_broken_clip_among_many_is_named_and_the_others_are_done(clips, cluster, capsys, out):
    whole = (clips / "b.h5").read_bytes()
    (clips / "b.h5").write_bytes(whole[:3000])
    words = ["batch", str(clips), "--out", str(out), *WORDS, "--scheduler", cluster]
    assert cli.main(words) == 1
    printed = capsys.readouterr()
    assert "3 clips done, 0 kept, 1 failed" in printed.out
    assert printed.err.splitlines()[-1].startswith(f"athcodec: failed: b.ath: {clips / 'b.h5'}: ")
    assert done_once(out) == {"a.ath", "long.ath", "sub/c.ath"} and not (out / "b.ath").exists()
    (clips / "b.h5").write_bytes(whole)
    assert cli.main([*words, "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert (result["done"], result["kept"], result["failed"]) == (1, 3, [])
    assert len(done_once(out)) == 4


def test_without_dask_the_command_that_installs_it_is_named(clips, tmp_path, monkeypatch):
    monkeypatch.setattr(runs, "find_spec", lambda name: None)
    with pytest.raises(MissingExtra, match=r'pip install "athcodec\[batch\]"'):
        batch.run(batch.find([clips], tmp_path / "out"), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_an_unreachable_scheduler_is_an_error_of_one_line(clips, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(runs, "CONNECTING", 0.5)
    assert cli.main(["batch", str(clips), "--out", str(tmp_path / "out"), "--scheduler", "tcp://127.0.0.1:1"]) == 1
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and "expected the address of a scheduler" in err


def test_a_scheduler_that_goes_away_ends_the_run_and_not_what_was_done(clips, cluster, monkeypatch, out):

    def close(line: str) -> None:
        if len(seen := list(lines(out))) == 1:
            assert seen[0]["status"] == "done"
            threading.Thread(target=own.close).start()

    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0") as own:
        with pytest.raises(runs.SchedulerError, match="the same command goes on"):
            batch.run(batch.find([clips], out), out, scheduler=own.scheduler_address, report=close)
    before = len(lines(out))
    assert 1 <= before < 4 and not leftovers(out)
    outcome = batch.run(batch.find([clips], out), out, scheduler=cluster)
    assert len(outcome.kept) == before and len(done_once(out)) == 4


# ---- processes that die and disks that are full ----


@pytest.fixture
def many(tmp_path):
    """Twelve clips that take a while, one of them long."""
    folder = tmp_path / "many"
    folder.mkdir()
    for seed in range(11):
        athcodec.write_hdf5(plant(seed=seed, branches=20, longest=8, frames=48), folder / f"c{seed:02}.h5")
    athcodec.write_hdf5(plant(seed=99, branches=20, longest=8, frames=300), folder / "long.h5")
    return folder


ALL = {*(f"c{seed:02}.ath" for seed in range(11)), "long.ath"}


def start(source: Path | str, out: Path, *words: str, **options) -> subprocess.Popen:
    command = [*BATCH, str(source), "--out", str(out), *WORDS, "--workers", "2", "--split", "3", *words]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def finished(process: subprocess.Popen) -> tuple[int, str]:
    _, err = process.communicate(timeout=120)
    return process.returncode, err


def workers_of(process: subprocess.Popen) -> list[psutil.Process]:
    return [child for child in psutil.Process(process.pid).children() if "spawn_main" in " ".join(child.cmdline())]


def wait_for(happened, process: subprocess.Popen) -> None:
    while not happened():
        assert process.poll() is None, process.stderr.read()
        time.sleep(0.01)


def lines_so_far(out: Path) -> int:
    path = out / runs.MANIFEST
    return path.read_bytes().count(b"\n") if path.exists() else 0


@pytest.mark.slow
def test_two_runs_at_once_do_not_disturb_each_other(clips, tmp_path):
    processes = [start(clips, tmp_path / name) for name in ("one", "two")]
    for process, name in zip(processes, ("one", "two")):
        code, err = finished(process)
        assert code == 0 and all(line.startswith("[") for line in err.splitlines()), err
        assert len(done_once(tmp_path / name)) == 4


@pytest.mark.slow
@pytest.mark.parametrize("after", [0, 3, 8])
def test_a_worker_that_is_killed_costs_nothing_but_time(after, many, out):
    process = start(many, out, "--verify")
    wait_for(lambda: lines_so_far(out) >= after and any(".ath." in part.name for part in leftovers(out)), process)
    workers_of(process)[0].kill()
    code, err = finished(process)
    assert code == 0, err
    assert done_once(out) == ALL and len(lines(out)) == 12 and not leftovers(out)
    assert (out / "long.ath").read_bytes() == alone(many / "long.h5", **FAST)


@pytest.mark.slow
def test_a_worker_that_is_killed_while_it_codes_a_part_of_a_long_clip_costs_that_part(many, out):
    process = start(many / "long.h5", out)
    wait_for(lambda: any(out.rglob("segments_0")), process)
    workers_of(process)[1].kill()
    code, err = finished(process)
    assert code == 0 and done_once(out) == {"long.ath"} and not leftovers(out), err
    assert (out / "long.ath").read_bytes() == alone(many / "long.h5", **FAST)


@pytest.mark.slow
def test_a_clip_whose_workers_die_each_time_is_given_up(many, out):
    process = start(many / "long.h5", out, "--split", "100", "--effort", "default")
    seen = set()
    while process.poll() is None:
        parts = {path.name for path in leftovers(out) if path.name.startswith(".long.ath.")}
        if parts - seen:  # a worker has begun, and all are killed
            seen |= parts
            for worker in workers_of(process):
                worker.kill()
        time.sleep(0.01)
    assert 2 <= len(seen) <= 4  # one may have died before it began
    code, err = finished(process)
    assert code == 1 and re.search(r"long.h5: 4 workers died that worked on it", err), err
    assert not leftovers(out) and lines(out)[0]["status"] == "failed"


@pytest.mark.slow
@pytest.mark.parametrize("after", [0, 2, 7])
def test_a_run_that_is_killed_goes_on_where_it_ended(after, many, out):
    process = start(many, out)
    wait_for(lambda: lines_so_far(out) >= after and workers_of(process), process)
    workers = workers_of(process)
    process.kill()
    process.communicate()
    psutil.wait_procs(workers, timeout=30)
    before = lines(out)
    assert after <= len(before) < 12
    code, err = finished(start(many, out, "--verify"))
    assert code == 0, err
    assert lines(out)[: len(before)] == before and len(lines(out)) == 12
    assert done_once(out) == ALL and not leftovers(out)


@pytest.mark.slow
@pytest.mark.parametrize(
    "number, expected, last",
    [(signal.SIGINT, 130, "athcodec: interrupted; the same command goes on from here\n"), (signal.SIGTERM, 143, "")],
)
def test_an_interrupted_run_leaves_whole_files_only(number, expected, last, many, out):
    process = start(many, out, start_new_session=True)
    wait_for(lambda: lines_so_far(out) >= 2, process)
    os.killpg(process.pid, number)  # as a terminal does it: workers get it too
    code, err = finished(process)
    assert code == expected and err.endswith(last), err
    assert all(line.startswith("[") for line in err.removesuffix(last).splitlines()), err
    assert not leftovers(out) and done_once(out) == {line["output"] for line in lines(out)} < ALL
    assert finished(start(many, out))[0] == 0 and done_once(out) == ALL


@pytest.mark.slow
@pytest.mark.parametrize("limit", [2000, 9000])
def test_a_full_disk_is_reported_and_a_second_run_does_what_is_missing(limit, many, out):
    process = start(many, out, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
    code, err = finished(process)
    assert code == 1 and "File too large" in err and "Traceback" not in err, err
    assert not leftovers(out)
    before = done_once(out)
    assert before < ALL
    code, err = finished(start(many, out, "--verify"))
    assert code == 0, err
    assert done_once(out) == ALL
