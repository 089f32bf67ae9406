"""ath_player.h: a file in memory is played by clip and time, in the caller's memory, and ahead on any thread."""

from __future__ import annotations

import ctypes
import subprocess
import sys
import threading
from ctypes import POINTER, byref, c_double, c_float, c_int32, c_size_t, c_uint32, c_uint64, c_void_p
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from counting import COUNTER
from files import Parts
from fuzz.targets import CORE
from header import Fade, Range
from moving_meshes import leafed_tree, mixed_clip
from test_install import C_COMPILERS, CXX_COMPILERS, run

import athcodec
from athcodec.decoding import container as ct
from athcodec.decoding import core_file
from athcodec.decoding.core_file import Fault

pytestmark = pytest.mark.formats

CLAMP, LOOP, PING_PONG, AS_MARKED = range(4)
FILE_ORDER, SOURCE_ORDER = range(2)
OK, BAD_CHECKSUM, BAD_CHUNK, MORE, HELD, MISSING, NO_MEMORY, BAD_ARGUMENT = 0, 5, 9, 64, 65, 66, 68, 69
BUDGET, EXACT = 150_000, 2**31 - 1
SHIPPED = Path(athcodec.__file__).parent / "sample" / "leafed_tree.ath"
VECTORS = Path(__file__).parent.parent / "spec" / "vectors" / "valid"
IMPLEMENTATION = '#define ATH_PLAYER_IMPLEMENTATION\n#include "ath_player.h"\n'

Allocate = ctypes.CFUNCTYPE(c_void_p, c_void_p, c_size_t)
Release = ctypes.CFUNCTYPE(None, c_void_p, c_void_p)


class Options(ctypes.Structure):
    _fields_ = [("allocate", Allocate), ("release", Release), ("context", c_void_p), ("cache_bytes", c_size_t)]
    _fields_ += [("limits", c_void_p), ("host_mesh", c_void_p), ("host_stride", c_size_t), ("host_vertices", c_int32)]
    _fields_ += [("in_slices", c_int32)]


class Share(ctypes.Structure):
    _fields_ = [("clip", c_int32), ("level", c_int32), ("wrap", c_int32), ("seconds", c_double), ("weight", c_double)]


class Moment(ctypes.Structure):
    _fields_ = [("frame", c_double), ("level", c_int32), ("count", c_int32), ("segments", c_void_p * 2)]


@pytest.fixture(scope="module")
def lib(tmp_path_factory):
    """The decoder as one file and the player, as an engine would compile them, but with their work counted."""
    folder = tmp_path_factory.mktemp("player")
    (folder / "player.c").write_text(IMPLEMENTATION)
    (folder / "counter.c").write_text(COUNTER)
    run(sys.executable, CORE / "amalgamate.py", folder / "ath.c")
    flags = ["-O2", "-g", "-fPIC", "-DATH_STATIC", "-fvisibility=default", "-I", CORE / "include"]
    run("cc", *flags, "-c", folder / "counter.c", "-o", folder / "counter.o")
    flags += ["-shared", "-fsanitize-coverage=trace-pc", folder / "counter.o"]
    run("cc", *flags, folder / "ath.c", folder / "player.c", "-lm", "-o", folder / "player.so")
    loaded = ctypes.CDLL(str(folder / "player.so"))
    for name in ("begin", "file", "fault"):
        getattr(loaded, f"ath_player_{name}").restype = c_void_p
    loaded.ath_player_prepared.restype = loaded.counted_work.restype = c_uint64
    return loaded


class Memory:
    """Counts what a player holds; allocation number `fails` gets none."""

    def __init__(self, fails: int = -1):
        self.held: dict[int, tuple[ctypes.Array, int]] = {}
        self.taken, self.most, self.fails = 0, 0, fails
        self.allocate, self.release = Allocate(self._take), Release(self._give)

    def _take(self, _, size):
        self.taken += 1
        if self.taken - 1 == self.fails:
            return None
        block = ctypes.create_string_buffer(size + 16)
        address = ctypes.addressof(block) + -ctypes.addressof(block) % 16
        self.held[address] = block, size
        self.most = max(self.most, self.bytes)
        return address

    def _give(self, _, address):
        del self.held[address]

    @property
    def bytes(self) -> int:
        return sum(size for _, size in self.held.values())


class Player:
    def __init__(self, lib, data: bytes, memory: Memory | None = None, budget: int = EXACT, **options):
        self.lib, self.data = lib, data
        self.player, self.fault = c_void_p(), Fault()
        if memory:
            options |= {"allocate": memory.allocate, "release": memory.release}
        self.result = lib.ath_player_open(
            byref(self.player), data, c_size_t(len(data)), byref(Options(**options)), byref(self.fault)
        )
        if self.player:
            lib.ath_player_set_budget(self.player, budget)

    def __enter__(self) -> Player:
        return self

    def __exit__(self, *_: object) -> None:
        self.lib.ath_player_close(self.player)

    def positions(self, count, seconds, level=-1, clip=0, wrap=CLAMP, order=SOURCE_ORDER):
        xyz = np.full((count, 3), np.nan, np.float32)
        result = self.lib.ath_player_positions(
            self.player, clip, c_double(seconds), wrap, level, order, xyz.ctypes, c_size_t(12)
        )
        return xyz if result in (OK, HELD) else result

    def level(self, seconds, level=-1, clip=0, wrap=CLAMP):
        moment = Moment()
        assert self.lib.ath_player_show(self.player, clip, c_double(seconds), wrap, level, byref(moment)) == OK
        return moment.level

    def blended(self, count, shares, order=SOURCE_ORDER):
        xyz = np.full((count, 3), np.nan, np.float32)
        result = self.lib.ath_player_blended_positions(
            self.player, (Share * len(shares))(*shares), len(shares), order, xyz.ctypes, c_size_t(12)
        )
        return xyz if result == OK else result

    def in_wind(self, count, winds, strength, heading, seconds):
        xyz, winds = np.full((count, 3), np.nan, np.float32), np.array(winds, np.float64)
        result = self.lib.ath_player_wind_positions(
            self.player, winds.ctypes, c_double(strength), c_double(heading), c_double(seconds), AS_MARKED, -1,
            SOURCE_ORDER, xyz.ctypes, c_size_t(12),
        )  # fmt: skip
        return xyz if result == OK else result

    def lines(self, kind, corners, order=SOURCE_ORDER):
        count, function = c_size_t(), getattr(self.lib, f"ath_player_{kind}")
        result = function(self.player, order, None, byref(count))
        if result != OK:
            return result
        out = np.empty((count.value, corners), np.uint32)
        assert function(self.player, order, out.ctypes, byref(count)) == OK
        return out

    def ahead(self) -> int:
        return self.lib.ath_player_ahead(self.player, EXACT)


@pytest.mark.parametrize(
    "command",
    [*([name, "-std=c11"] for name in C_COMPILERS), *([name, "-xc++", "-std=c++17"] for name in CXX_COMPILERS)],
)
def test_it_compiles_without_warnings(command, tmp_path):
    (tmp_path / "player.c").write_text(IMPLEMENTATION)
    strict = ["-O2", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-DATH_STATIC", "-I", CORE / "include"]
    run(*command, *strict, "-c", tmp_path / "player.c", "-o", tmp_path / "player.o")


# ---- showing ----


def test_any_moment_in_any_order_is_what_python_decodes(lib, medley_ath):
    data = medley_ath.read_bytes()
    rng = np.random.default_rng(3)
    with athcodec.open(medley_ath) as file, Player(lib, data, cache_bytes=1) as player:
        names = [clip.name for clip in file.file.clips]
        decoders = {name: athcodec.open(medley_ath, clip=name) for name in names}
        for _ in range(200):
            clip, level = int(rng.integers(len(names))), int(rng.integers(-1, file.file.level_count))
            decoder = decoders[names[clip]]
            frame = int(rng.integers(decoder.frame_count))
            seconds = decoder.time[frame] - decoder.time[0]
            shown = player.positions(file.file.vertex_count, seconds, level, clip)
            wanted = decoder.positions(frame, level=None if level < 0 else level)
            np.testing.assert_array_equal(shown, wanted)
        for decoder in decoders.values():
            decoder.close()


def test_between_frames_positions_are_between_theirs_also_where_segments_meet(lib, sample_ath):
    with athcodec.open(sample_ath) as file, Player(lib, sample_ath.read_bytes()) as player:
        positions, time = file.positions(), file.time
        for frame in (0, 38, 39, 40, 79, 117):
            seconds = 0.25 * time[frame] + 0.75 * time[frame + 1] - time[0]
            wanted = 0.25 * positions[frame].astype(float) + 0.75 * positions[frame + 1]
            np.testing.assert_allclose(player.positions(file.file.vertex_count, seconds), wanted, atol=1e-5)


def test_matrices_and_exact_vertices_give_the_same_positions(lib, sample_ath):
    with athcodec.open(sample_ath) as file, Player(lib, sample_ath.read_bytes()) as player:
        for level in range(file.file.level_count):
            nodes, exact, shown = c_int32(), c_int32(), c_int32(-1)
            core = c_void_p(lib.ath_player_file(player.player))
            lib.ath_cut_size(core, level, None, byref(nodes), byref(exact))
            matrices = np.full((nodes.value, 3, 4), np.nan, np.float32)
            runs = np.full((exact.value, 3), np.nan, np.float32)
            result = lib.ath_player_matrices(
                player.player, 0, c_double(1.0), CLAMP, level, matrices.ctypes, runs.ctypes, byref(shown)
            )
            assert (result, shown.value) == (OK, level)
            positions = player.positions(file.file.vertex_count, 1.0, level, order=FILE_ORDER)
            found = {tuple(row) for row in positions.tolist()}
            assert np.isfinite(matrices).all() and len(matrices) + len(runs) > 0
            assert {tuple(row) for row in runs.tolist()} <= found


@pytest.mark.parametrize("share", [0.1, 0.35])
def test_a_fade_is_between_its_levels(lib, sample_ath, share):
    with athcodec.open(sample_ath) as file, Player(lib, sample_ath.read_bytes()) as player:
        fade, xyz = Fade(), np.empty((file.file.vertex_count, 3), np.float32)
        lib.ath_fade_to(byref(fade), 1, c_double(1.0))
        for _ in range(2):
            lib.ath_fade_to(byref(fade), 2, c_double(share))
        frame = 39.5  # in two segments
        seconds = np.interp(frame, np.arange(file.frame_count), file.time) - file.time[0]
        result = lib.ath_player_faded_positions(
            player.player, 0, c_double(seconds), CLAMP, byref(fade), SOURCE_ORDER, xyz.ctypes, c_size_t(12)
        )
        assert result == OK
        coarse, fine = (player.positions(file.file.vertex_count, seconds, level).astype(float) for level in (1, 2))
        weight = fade.weight[1]
        assert 0 < weight < 1
        np.testing.assert_allclose(xyz, (1 - weight) * coarse + weight * fine, atol=1e-5)


def test_of_a_prefix_the_deepest_level_that_is_there_is_shown(lib, sample_ath):
    data = sample_ath.read_bytes()
    with athcodec.open(sample_ath) as file:
        wanted = [file.positions(5, level=level) for level in range(file.file.level_count)]
        count = file.file.vertex_count
    levels = set()
    for length in np.linspace(len(data) * 0.3, len(data), 25).astype(int):
        with Player(lib, data[:length]) as player:
            if player.result == MISSING:
                continue
            shown = player.positions(count, np.float64(5 / 30))
            if isinstance(shown, int):
                assert shown == MISSING
                continue
            (level,) = (i for i, pose in enumerate(wanted) if np.allclose(pose, shown, atol=1e-5))
            levels.add(level)
    assert len(levels) >= 2 and len(wanted) - 1 in levels


def feed(player: Player, level: int, change: bytes = b"") -> None:
    """Hands over the ranges that a level of the first clip needs, with other bytes at the front of each."""
    file, ranges = c_void_p(player.lib.ath_player_file(player.player)), (Range * 64)()
    with athcodec.open(player.whole) as decoder:
        last = len(decoder.segments) - 1
    count = player.lib.ath_ranges(file, level, 0, last, 0, ranges, 64)
    for start, size in [(one.offset, one.size) for one in ranges[:count]]:
        player.fed.append(change + player.whole[start + len(change) : start + size])
        player.lib.ath_player_feed(player.player, player.fed[-1], c_uint64(start), c_size_t(size))


def of_prelude(lib, data: bytes, budget: int) -> Player:
    """A player that has the front and the prelude alone."""
    front, memory = c_size_t(), c_size_t()
    assert lib.ath_front(data, c_size_t(len(data)), None, byref(front), byref(memory), None) == OK
    player = Player(lib, data[: front.value], budget=budget)
    player.whole, player.fed = data, []
    return player


@pytest.mark.parametrize("budget", [EXACT, BUDGET])
@pytest.mark.parametrize("name", ["shipped tree", "sample", "layers-mixed", "clips-loops"])
def test_levels_play_from_their_ranges_alone_however_they_are_ordered(name, budget, lib, sample_ath):
    """The bytes of a deep level are not those of all levels before it."""
    path = {"sample": sample_ath, "shipped tree": SHIPPED}.get(name, VECTORS / f"{name}.ath")
    with athcodec.open(path) as file:
        count, levels = file.file.vertex_count, range(file.file.level_count)
        wanted = [np.asarray(file.positions(0, level=level), np.float32) for level in levels]
    for order in (levels, [levels[-1], 0], [levels[len(levels) // 2], levels[-1]]):
        with of_prelude(lib, path.read_bytes(), budget) as player:
            assert player.positions(count, 0.0) == MISSING
            for level in order:
                feed(player, level)
                for _ in range(200):  # calls with a budget, until the level is prepared
                    shown = player.positions(count, 0.0, level)
                    assert isinstance(shown, np.ndarray), shown
                assert lib.ath_player_ahead(player.player, EXACT) == OK
                assert np.array_equal(player.positions(count, 0.0, level), wanted[level])


def test_bytes_that_were_damaged_on_their_way_may_come_again(lib, sample_ath):
    with athcodec.open(sample_ath) as file:
        count, deepest = file.file.vertex_count, file.file.level_count - 1
        wanted = np.asarray(file.positions(0), np.float32)
    with of_prelude(lib, sample_ath.read_bytes(), BUDGET) as player:
        feed(player, 0)
        feed(player, deepest, change=b"damage")
        assert isinstance(player.positions(count, 0.0, 0), np.ndarray)
        calls = [player.positions(count, 0.0) for _ in range(50)]
        results = {result for result in calls if isinstance(result, int)}
        assert results == {BAD_CHECKSUM}
        lib.ath_player_feed(player.player, player.whole, c_uint64(0), c_size_t(len(player.whole)))
        lib.ath_player_set_budget(player.player, EXACT)
        assert np.array_equal(player.positions(count, 0.0), wanted)


def test_what_no_clip_has_is_refused_and_damage_named(lib, sample_ath):
    parts = Parts.of(sample_ath.read_bytes())
    deepest = max(chunk.level for chunk, _ in parts.chunks if chunk.kind == ct.STEMS)
    with Player(lib, parts.with_payload(ct.STEMS, b"\xff" * 40, deepest)) as player:
        assert player.positions(1001, 0.0, clip=1) == BAD_ARGUMENT
        assert player.positions(1001, 0.0) == BAD_CHUNK
        fault = ctypes.cast(lib.ath_player_fault(player.player), POINTER(Fault)).contents
        assert "STEMS" in str(fault) and f"level {deepest}" in str(fault)
        assert isinstance(player.positions(1001, 0.0, level=0), np.ndarray)  # what is whole plays on
    with Player(lib, b"no plant, but as long as a header might be") as player:
        assert player.result == 2 and "expected 0x89415448" in str(player.fault)


def test_a_mesh_of_the_host_is_asked_for(lib, sample_clip):
    data = athcodec.encode(sample_clip, host_rest=True, ladder="none")
    with Player(lib, data) as player:
        assert player.result == 12
    mesh = np.ascontiguousarray(sample_clip.source_rest, np.float32)
    with Player(lib, data, host_mesh=mesh.ctypes.data, host_stride=12, host_vertices=len(mesh)) as player:
        assert isinstance(player.positions(len(mesh), 1.0), np.ndarray)


# ---- in slices ----


def works(player: Player, *calls) -> np.ndarray:
    """Vertex-frames as the player tells them, and basic blocks that are executed, of each call."""
    lib, totals = player.lib, []
    for call in (lambda: None, *calls):
        call()
        totals.append((lib.ath_player_prepared(player.player), lib.counted_work()))
    return np.diff(np.array(totals, np.int64), axis=0)


@pytest.mark.parametrize("name", ["shipped tree", "sample", "medley"])
def test_no_call_prepares_more_than_its_budget_one_step_and_level_0(name, lib, sample_ath, medley_ath):
    """Playing, seeking, and changing clips and levels."""
    path, rng = {"sample": sample_ath, "medley": medley_ath}.get(name, SHIPPED), np.random.default_rng(5)
    with athcodec.open(path) as file:
        count, levels, clips = file.file.vertex_count, file.file.level_count, len(file.file.clips)
    with Player(lib, path.read_bytes()) as player:
        shows = (partial(player.positions, count, 0.0, level) for level in (-1, -1, 0))
        (frames, blocks), (_, shown), (coarsest, _) = works(player, *shows)
    calls = []
    with Player(lib, path.read_bytes(), budget=BUDGET) as player:
        for _ in range(10):
            start, level, clip = rng.uniform(0, 5), int(rng.integers(-1, levels)), int(rng.integers(clips))
            for i in range(40):
                calls.append(partial(player.positions, count, start + i / 60, level, clip, LOOP))
                calls.append(partial(lib.ath_player_ahead, player.player, BUDGET))
        largest = works(player, *calls).max(axis=0)
    print(f"{name}: {largest[0]} of {frames} vertex-frames, {largest[1]} of {blocks} blocks in the longest call")
    most = BUDGET + max(16384, 64 * 80 * levels) + coarsest  # segments of these files are shorter than 80 frames
    assert largest[0] <= most and largest[1] <= 2 * (shown + most * (blocks - shown) / frames)


OPENED = ["shipped tree", "sample", "places-layers", "rest-of-level-1", "layers-mixed", "rest-copies"]


@pytest.mark.parametrize("name", OPENED)
def test_opening_in_slices_keeps_to_its_budget_and_gives_the_same(name, lib, sample_ath):
    path, budget = {"sample": sample_ath, "shipped tree": SHIPPED}.get(name, VECTORS / f"{name}.ath"), 100
    with athcodec.open(path) as file, Player(lib, path.read_bytes()) as whole:
        count, levels, longest = file.file.vertex_count, file.file.level_count, file.file.tables.branches["count"].max()
        most = budget + max(98304, count, file.frame_count, 16 * longest)
        with Player(lib, path.read_bytes(), in_slices=1, budget=0) as player:
            result, costs = player.result, []

            def step():
                nonlocal result
                result = lib.ath_player_ahead(player.player, budget)

            for shown in (0, levels - 1):  # level 0 is shown at once; the deepest one is built and prepared in slices
                while result == MORE:
                    costs.extend(works(player, step)[:, 0])
                assert result == OK and player.level(0.0) == shown
                result = MORE
            lib.ath_player_set_budget(player.player, EXACT)
            for level in range(levels):
                pair = (opened.positions(count, 0.0, level) for opened in (player, whole))
                np.testing.assert_array_equal(*pair, strict=True)
        assert len(costs) > 10 and max(costs) <= most


@pytest.mark.parametrize("kind", [ct.HIERARCHY, ct.REST, ct.TIME, ct.FACES])
def test_the_slice_that_finds_damage_reports_it_as_opening_at_once_does(kind, lib):
    data = Parts.of(SHIPPED.read_bytes()).with_payload(kind, b"\xff" * 40)
    with Player(lib, data) as whole, Player(lib, data, in_slices=1) as player:
        while (result := lib.ath_player_ahead(player.player, 1000)) == MORE:
            pass
        fault = ctypes.cast(lib.ath_player_fault(player.player), POINTER(Fault)).contents
        assert result == whole.result == BAD_CHUNK and str(fault) == str(whole.fault)


def test_a_level_is_shown_at_once_and_grows_to_the_one_that_is_asked_for(lib):
    with athcodec.open(SHIPPED) as file, Player(lib, SHIPPED.read_bytes(), budget=BUDGET) as player:
        deepest = file.file.level_count - 1
        for frame in (100, 3):
            seconds = file.time[frame] - file.time[0]
            levels = [player.level(seconds)]
            while levels[-1] < deepest:
                levels.append(player.level(seconds))
            assert levels == sorted(levels) and 0 == levels[0] < levels[20] < deepest
            np.testing.assert_array_equal(player.positions(file.file.vertex_count, seconds), file.positions(frame))


def test_a_deeper_level_stays_until_the_coarser_one_is_prepared_but_not_in_matrices(lib, sample_ath):
    with athcodec.open(sample_ath) as file, Player(lib, sample_ath.read_bytes()) as player:
        deepest, shown = file.file.level_count - 1, c_int32(-1)
        assert player.level(0.0) == deepest
        lib.ath_player_set_budget(player.player, 1)
        assert player.level(0.0, deepest - 1) == deepest
        matrices, exact = np.empty((1001, 12), np.float32), np.empty((1001, 3), np.float32)
        arguments = 0, c_double(0.0), CLAMP, deepest - 1, matrices.ctypes, exact.ctypes, byref(shown)
        assert lib.ath_player_matrices(player.player, *arguments) == OK and shown.value < deepest
        while player.level(0.0, deepest - 1) == deepest:
            pass
        assert player.level(0.0, deepest - 1) == deepest - 1


def test_where_the_next_segment_is_not_prepared_the_last_frame_is_held(lib, sample_ath):
    with athcodec.open(sample_ath) as file, Player(lib, sample_ath.read_bytes()) as player:
        last, after = file.time[39] - file.time[0], file.time[40] - file.time[0]
        wanted = player.positions(1001, last)
        lib.ath_player_set_budget(player.player, 0)
        np.testing.assert_array_equal(player.positions(1001, (last + after) / 2), wanted)


def test_moments_that_are_shown_in_turn_are_all_prepared(lib, sample_ath):
    with athcodec.open(sample_ath) as file, Player(lib, sample_ath.read_bytes(), budget=5000) as player:
        deepest = file.file.level_count - 1
        for _ in range(500):
            levels = [player.level(seconds) for seconds in (0.1, 2.1, 3.1)]
        assert levels == [deepest] * 3


def test_damage_is_found_once_and_told_again_without_work(lib, sample_ath):
    parts = Parts.of(sample_ath.read_bytes())
    deepest = max(chunk.level for chunk, _ in parts.chunks if chunk.kind == ct.STEMS)
    with Player(lib, parts.with_payload(ct.STEMS, b"\xff" * 40, deepest), budget=BUDGET) as player:
        while isinstance(player.positions(1001, 0.0), np.ndarray):
            pass
        assert works(player, lambda: player.positions(1001, 0.0))[0, 0] == 0
        assert player.positions(1001, 0.0) == BAD_CHUNK
        assert isinstance(player.positions(1001, 0.0, level=0), np.ndarray)


# ---- memory ----


def test_prepared_segments_stay_within_the_cache_and_nothing_is_left(lib, sample_ath):
    memory, data = Memory(), sample_ath.read_bytes()
    with athcodec.open(sample_ath) as file:
        seconds = file.time - file.time[0]
    with Player(lib, data, memory, cache_bytes=1) as player:
        opened = memory.bytes
        player.positions(1001, 0.0)
        one = memory.bytes - opened  # a segment and the work memory
        for _ in range(3):
            for time in seconds[::7]:
                assert isinstance(player.positions(1001, time), np.ndarray)
                while player.ahead() == MORE:
                    pass
        assert memory.bytes <= opened + 2 * one
    assert not memory.held


def test_what_is_kept_is_not_prepared_again(lib, sample_ath):
    memory = Memory()
    with Player(lib, sample_ath.read_bytes(), memory) as player:
        for time in (0.0, 2.0, 3.5):
            player.positions(1001, time)
        taken = memory.taken
        for time in (3.5, 0.5, 2.1):
            player.positions(1001, time)
        assert memory.taken == taken


def test_without_memory_the_player_says_so_and_leaks_nothing(lib, sample_ath):
    """Every allocation fails once, in opening, showing, preparing ahead and topology."""
    data = sample_ath.read_bytes()

    def play(memory: Memory) -> list:
        with Player(lib, data, memory) as player:
            if player.result != OK:
                return [player.result]
            shown = [player.positions(1001, time) for time in (0.0, 2.0)]
            return [
                *(result for result in shown if isinstance(result, int)),
                *(result for result in [player.ahead()] if result not in (OK, MORE)),
                *(result for result in [player.lines("lines", 2, FILE_ORDER)] if isinstance(result, int)),
            ]

    whole = Memory()
    assert play(whole) == []
    for number in range(whole.taken):
        memory = Memory(number)
        assert set(play(memory)) <= {NO_MEMORY}, number
        assert not memory.held


# ---- ahead ----


@pytest.mark.parametrize("wrap, times", [(CLAMP, (0, 1.2)), (LOOP, (3.9, 4.05)), (PING_PONG, (3.5, 5.4))])
def test_the_segment_that_comes_is_there_when_its_time_comes(lib, sample_ath, wrap, times):
    """Forwards, over the seam of a loop, and backwards: showing it then takes no memory."""
    memory = Memory()
    with Player(lib, sample_ath.read_bytes(), memory) as player:
        start, end = times
        for time in np.arange(start, end, 1 / 60):
            player.positions(1001, time, wrap=wrap)
            player.lib.ath_player_ahead(player.player, 40_000)
        while player.ahead() == MORE:
            pass
        assert player.ahead() == OK  # nothing is left to do
        taken = memory.taken
        assert isinstance(player.positions(1001, end + 0.2, wrap=wrap), np.ndarray)
        assert memory.taken == taken


@pytest.mark.parametrize("budget", [BUDGET, BUDGET // 4])
def test_playing_on_shows_no_coarser_level_than_before(lib, budget):
    """Over the boundaries of segments, whether the level that is asked for is ready in time or not."""
    with athcodec.open(SHIPPED) as file, Player(lib, SHIPPED.read_bytes(), budget=budget) as player:
        step = 1 / 30 if budget == BUDGET else 1 / 60
        duration, deepest = file.time[file.file.clips[0].frame_count - 1] - file.time[0], file.file.level_count - 1
        levels = []
        for time in np.arange(0, duration, step):
            levels.append(player.level(time, wrap=LOOP))
            lib.ath_player_ahead(player.player, budget)
    assert 0 == levels[0] < levels[-1] and levels == sorted(levels)
    assert budget != BUDGET or levels[-1] == deepest


def test_jobs_run_on_other_threads_while_this_one_shows(lib, sample_ath):
    with athcodec.open(sample_ath) as file:
        wanted, seconds = file.positions(), file.time - file.time[0]
    with Player(lib, sample_ath.read_bytes(), cache_bytes=1) as player:
        jobs = 0
        for _ in range(5):
            for frame in range(0, len(wanted), 3):
                job = c_void_p(lib.ath_player_begin(player.player))
                thread = threading.Thread(target=lib.ath_player_run, args=(job, EXACT)) if job else None
                if thread:
                    thread.start()
                    jobs += 1
                np.testing.assert_array_equal(player.positions(1001, seconds[frame], wrap=LOOP), wanted[frame])
                if thread:
                    thread.join()
                    lib.ath_player_end(player.player, job)
        assert jobs >= 5


def test_a_job_that_is_not_done_can_be_dropped(lib, sample_ath):
    memory = Memory()
    with Player(lib, sample_ath.read_bytes(), memory) as player:
        player.positions(1001, 0.0)
        job = c_void_p(lib.ath_player_begin(player.player))
        assert job and lib.ath_player_run(job, 1) == MORE
        assert lib.ath_player_begin(player.player) is None  # that segment is under way
        lib.ath_player_end(player.player, job)
        again = c_void_p(lib.ath_player_begin(player.player))
        assert again  # closing ends it
    assert not memory.held


# ---- several clips ----


def test_clips_are_blended_as_python_blends_them(lib, medley_ath):
    rng = np.random.default_rng(7)
    with athcodec.open(medley_ath) as file, Player(lib, medley_ath.read_bytes(), cache_bytes=1) as player:
        names = [clip.name for clip in file.file.clips]
        for _ in range(30):
            chosen = rng.permutation(len(names))[: rng.integers(1, 5)]
            seconds = {names[i]: float(rng.uniform(0, 2)) for i in chosen}
            weights = {name: float(rng.uniform(0.1, 1)) for name in seconds}
            level = int(rng.integers(file.file.level_count))
            shares = [Share(names.index(n), level, AS_MARKED, seconds[n], weights[n]) for n in seconds]
            unused = Share(len(names), 99, LOOP, 0.0, 0.0)
            shown = player.blended(file.file.vertex_count, [*shares, unused])
            np.testing.assert_array_equal(shown, file.blended(weights, seconds, level))


def test_two_times_of_a_clip_are_blended_as_python_blends_them(lib, medley_ath):
    with athcodec.open(medley_ath) as file, Player(lib, medley_ath.read_bytes()) as player:
        places = [(0.1, 0.25), (0.7, 0.75)]
        shown = player.blended(file.file.vertex_count, [Share(0, -1, AS_MARKED, *place) for place in places])
        np.testing.assert_array_equal(shown, file.blended_places(places))


def test_the_wind_chooses_what_is_blended(lib, medley_ath):
    with athcodec.open(medley_ath) as file, Player(lib, medley_ath.read_bytes()) as player:
        names = [clip.name for clip in file.file.clips]
        winds = [(2.0 + 6.0 * (i > 0), 90.0 * i) for i in range(len(names))]
        for strength, heading in ((0, 0), (5, 130), (8, 95), (99, 300)):
            weights = core_file.wind_weights(np.array(winds), strength, heading)
            shown = player.in_wind(file.file.vertex_count, winds, strength, heading, 0.37)
            np.testing.assert_array_equal(shown, file.blended(dict(zip(names, weights.tolist())), 0.37))


def test_blends_without_a_weight_or_a_clip_or_memory_are_refused(lib, medley_ath):
    data, memory = medley_ath.read_bytes(), Memory()
    with athcodec.open(medley_ath) as file, Player(lib, data, memory) as player:
        count, clips = file.file.vertex_count, len(file.file.clips)
        for weights, clip in (([], 0), ([0.0], 0), ([float("nan")], 0), ([1.0] * 5, 0), ([1.0], clips), ([1.0], -1)):
            assert player.blended(count, [Share(clip, -1, CLAMP, 0.0, weight) for weight in weights]) == BAD_ARGUMENT
        memory.fails = memory.taken
        both = [Share(0, -1, CLAMP, 0.1, 1.0), Share(1, -1, CLAMP, 0.2, 1.0)]
        assert player.blended(count, both) == NO_MEMORY
        assert isinstance(player.blended(count, both), np.ndarray)
    assert not memory.held


def test_what_comes_of_each_blended_clip_is_prepared_ahead(lib, sample_clip):
    memory = Memory()
    data = athcodec.encode(athcodec.join({"one": sample_clip, "other": sample_clip}), rel_error=1e-3)
    with Player(lib, data, memory) as player:

        def at(seconds):
            return player.blended(sample_clip.vertex_count, [Share(i, -1, CLAMP, seconds, 1.0) for i in range(2)])

        at(0.5)
        for _ in range(2):  # a segment of each
            assert player.ahead() == OK
        assert lib.ath_player_begin(player.player) is None  # nothing is left to do
        taken = memory.taken
        assert isinstance(at(1.5), np.ndarray) and memory.taken == taken


# ---- topology ----


def fans(counts, corners) -> np.ndarray:
    starts = np.cumsum(counts) - counts
    return np.array(
        [(corners[s], corners[s + i - 1], corners[s + i]) for s, n in zip(starts, counts) for i in range(2, n)]
    )


def test_triangles_are_fans_of_the_faces_in_either_order(lib):
    clip = mixed_clip()
    data = athcodec.encode(clip, rel_error=1e-4)
    with athcodec.open(data) as file, Player(lib, data) as player:
        wanted = fans(clip.attributes["face_vertex_counts"], clip.attributes["face_vertex_indices"])
        np.testing.assert_array_equal(player.lines("triangles", 3), wanted)
        own = player.lines("triangles", 3, FILE_ORDER)
        there = player.positions(file.file.vertex_count, 0.1, order=FILE_ORDER)
        np.testing.assert_array_equal(there[own], player.positions(file.file.vertex_count, 0.1)[wanted])


def test_lines_are_those_of_the_source_or_along_stems(lib, full_ath, full_clip, bushy_clip):
    with Player(lib, full_ath.read_bytes()) as player:
        np.testing.assert_array_equal(player.lines("lines", 2), full_clip.edges)
    with Player(lib, athcodec.encode(bushy_clip, rel_error=1e-3)) as player:
        lines = player.lines("lines", 2)
        assert player.lines("triangles", 3) == BAD_ARGUMENT
    roots = int((np.asarray(bushy_clip.branch_parent) < 0).sum())
    assert len(lines) == bushy_clip.vertex_count - roots and len(np.unique(lines[:, 1])) == len(lines)


def normals_of(lib, triangles, points) -> np.ndarray:
    points, out = np.ascontiguousarray(points, np.float32), np.empty((len(points), 3), np.float32)
    lib.ath_player_normals(
        triangles.ctypes, c_size_t(len(triangles)), points.ctypes, c_size_t(12), len(points), out.ctypes
    )
    return out


def test_normals_of_decoded_positions_are_those_of_the_source_within_a_degree(lib):
    clip = leafed_tree()
    source = clip.block(0, clip.frame_count)
    with Player(lib, athcodec.encode(clip, rel_error=1e-4)) as player:
        triangles = player.lines("triangles", 3)
        decoded = player.positions(clip.vertex_count, float(clip.time[10] - clip.time[0]))
    faces = np.asarray(triangles, int)
    summed = np.zeros((clip.vertex_count, 3))
    a, b, c = (source[10][faces[:, k]].astype(float) for k in range(3))
    for k in range(3):
        np.add.at(summed, faces[:, k], np.cross(b - a, c - a))
    used = np.unique(faces)
    wanted = summed[used] / np.linalg.norm(summed[used], axis=1, keepdims=True)
    own = normals_of(lib, triangles, source[10])[used]
    np.testing.assert_allclose(own, wanted, atol=1e-4)
    shown = normals_of(lib, triangles, decoded)[used]
    angle = np.degrees(np.arccos(np.clip((shown * wanted).sum(axis=1), -1, 1)))
    assert np.sqrt((angle**2).mean()) <= 1.0


def test_bounds_are_the_box_of_what_is_shown(lib, sample_ath):
    with athcodec.open(sample_ath) as file:
        points, box = np.ascontiguousarray(file.positions(20)), np.zeros(6, np.float32)
    for count in (len(points), 1):
        spaced = np.full((count, 5), np.nan, np.float32)
        spaced[:, :3] = points[:count]
        lib.ath_player_bounds(spaced.ctypes, c_size_t(20), count, box.ctypes)
        assert box.tolist() == [*points[:count].min(axis=0), *points[:count].max(axis=0)]


def test_tangents_follow_u_at_right_angles_to_normals(lib):
    """A bent strip whose u runs along x, and one that is mirrored."""
    x, y = np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 4))
    points = np.stack([x.ravel(), y.ravel(), 0.2 * x.ravel() ** 2], axis=1).astype(np.float32, order="C")
    corners = np.arange(20).reshape(4, 5)
    quads = np.stack([corners[:-1, :-1], corners[:-1, 1:], corners[1:, 1:], corners[1:, :-1]], axis=-1).reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(c_uint32, order="C")
    normals = normals_of(lib, triangles, points)
    for mirror in (1, -1):
        uv = np.stack([mirror * x.ravel(), y.ravel()], axis=1).astype(np.float32, order="C")
        tangents = np.empty((20, 4), c_float)
        lib.ath_player_tangents(
            triangles.ctypes, c_size_t(len(triangles)), points.ctypes, c_size_t(12), uv.ctypes, c_size_t(8),
            normals.ctypes, 20, tangents.ctypes,
        )  # fmt: skip
        np.testing.assert_allclose((tangents[:, :3] * normals).sum(axis=1), 0, atol=1e-5)
        np.testing.assert_allclose(np.linalg.norm(tangents[:, :3], axis=1), 1, atol=1e-5)
        assert (mirror * tangents[:, 0] > 0.8).all() and (tangents[:, 3] == mirror).all()
        bitangents = np.cross(normals, tangents[:, :3]) * tangents[:, 3:]
        assert (bitangents[:, 1] > 0.8).all()  # along v


@pytest.mark.slow
def test_it_runs_clean_under_sanitizers(sample_ath, tmp_path):
    """All of a program's calls, with memory that is too old or too small caught."""
    (tmp_path / "program.c").write_text(IMPLEMENTATION + PROGRAM)
    run(sys.executable, CORE / "amalgamate.py", tmp_path / "ath.c")
    flags = "-g -O1 -fsanitize=address,undefined -fno-sanitize-recover -DATH_STATIC".split()
    sources = tmp_path / "ath.c", tmp_path / "program.c"
    run("cc", *flags, "-I", CORE / "include", *sources, "-lm", "-o", tmp_path / "program")
    done = subprocess.run([str(tmp_path / "program"), str(sample_ath)], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "90 shown\n", "")


PROGRAM = r"""
#include <stdio.h>
static uint8_t bytes[1 << 20];
int main(int argc, char **argv)
{
    static float xyz[3 * 4096], normals[3 * 4096];
    static uint32_t lines[2 * 4096];
    size_t size = argc > 1 ? fread(bytes, 1, sizeof bytes, fopen(argv[1], "rb")) : 0, count;
    ath_player_options options = {.cache_bytes = 1 << 20};
    ath_player *player;
    int shown = 0;
    if (ath_player_open(&player, bytes, size, &options, NULL) != ATH_OK) return 1;
    ath_info info;
    ath_get_info(ath_player_file(player), &info);
    if (ath_player_lines(player, ATH_SOURCE_ORDER, NULL, &count) != ATH_OK || count > 4096) return 2;
    if (ath_player_lines(player, ATH_FILE_ORDER, lines, &count) != ATH_OK) return 3;
    for (int i = 0; i < 90; i++) {
        int32_t level = i / 9 % info.level_count;
        int result = ath_player_positions(player, 0, 0.31 * i, ATH_PING_PONG, level, ATH_FILE_ORDER, xyz, 12);
        if (result != ATH_OK) return 4;
        ath_player_normals(lines, count / 2, xyz, 12, info.vertex_count, normals);
        ath_player_ahead(player, 4000 * i);
        shown++;
    }
    ath_player_close(player);
    ath_player_close(NULL);
    return printf("%d shown\n", shown) < 0;
}
"""
