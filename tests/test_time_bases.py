"""Learned bases over time: shared by the levels of a layer, worth their bytes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_document import assert_same_bits

import athcodec
from athcodec import encoding
from athcodec.decoding.container import BASIS_IN_WAVES, STEMS
from athcodec.encoding.options.features import Feature
from athcodec.encoding.search import search
from athcodec.encoding.search.choices import learned_bases
from athcodec.encoding.segments import layers
from athcodec.encoding.segments.segment import CodedPrelude
from bench.odd.bending import FPS, Bones, clip_of, gusty
from bench.trees.plant import grow
from spec.document import File

pytestmark = pytest.mark.sizes


def hit_by_a_gust(seed: int = 5, frames: int = 60, after: float = 1.0) -> athcodec.MotionClip:
    """A calm shrub that bends once, after so many seconds."""
    bones, rng = Bones.of(grow(300, 2, 8.0, seed)), np.random.default_rng(seed)
    time, stems = np.arange(frames) / FPS, len(bones.branch_parent)
    late, strength = rng.uniform(0, 0.5, stems), rng.uniform(0.25, 0.75, stems)
    hit = strength * np.exp(-(((time[:, None] - after - late) / 0.35) ** 2))
    turns = gusty(time, stems, 0.01, 0.0, rng) + hit[..., None] * np.sqrt([0.5, 0, 0.5])
    return clip_of(bones, bones.bent(turns))


def in_series_of_levels(seed: int = 5, frames: int = 128, count: int = 12) -> athcodec.MotionClip:
    """A shrub each level of which bends by a few series of its own, as plants do that grow by rules."""
    bones, rng = Bones.of(grow(400, 4, 8.0, seed)), np.random.default_rng(seed)
    depth = np.zeros(len(bones.branch_parent), int)
    for branch, parent in enumerate(bones.branch_parent):
        depth[branch] = depth[parent] + 1 if parent >= 0 else 0
    series, mix = rng.normal(size=(frames, depth.max() + 1, count)), rng.normal(size=(len(depth), count))
    turns = 0.05 * np.einsum("tbk,bk->tb", series[:, depth], mix)
    return clip_of(bones, bones.bent(turns[..., None] * np.array([1, 0, 0.5])))


@pytest.mark.parametrize("effort", ["fast", pytest.param("default", marks=pytest.mark.slow)])
def test_levels_that_need_bases_of_their_own_get_one_layer_unless_layers_are_named(effort, tmp_path):
    def size(**options) -> int:
        return athcodec.encode(clip, tmp_path / "a.ath", attributes="none", effort=effort, **options).bytes

    clip = in_series_of_levels()
    assert size() <= 1.01 * size(ladder="none") < 0.8 * size(ladder=(1e-2, 1e-3))


def stems_heads(data: bytes) -> list[tuple[int, int, int]]:
    """Basis, Basis_Level and Basis_Length of each level with STEMS, of files of one segment and layer."""
    file = File(data)
    own = [file.content(*key) for key in file.chunks if key[0] == STEMS]
    return [(chunk[5], chunk[8], int.from_bytes(chunk[9:13], "little")) for chunk in own]


def test_levels_share_a_basis_that_lies_with_the_first_of_them(tmp_path):
    path, clip = tmp_path / "gust.ath", hit_by_a_gust(frames=90, after=2.0)
    summary = athcodec.encode(clip, path, rel_error=3e-4, ladder="none", attributes="none")
    assert summary.choices["common_basis"]
    (_, base, length), *others = stems_heads(path.read_bytes())
    assert base == 255 and length > 0 and others
    assert all((own[0], own[2]) == (BASIS_IN_WAVES, 0) and own[1] < 255 for own in others)
    with athcodec.open(path) as decoder:
        errors = np.linalg.norm(decoder.play(decoder.file.clips[0].name).positions() - clip.positions, axis=2)
    assert errors.max() <= summary.max_error_bound
    assert_same_bits(path.read_bytes())


def test_a_shared_basis_makes_files_smaller(tmp_path, monkeypatch):
    clip, options = hit_by_a_gust(), {"rel_error": 1e-3, "ladder": "none", "attributes": "none"}
    shared = athcodec.encode(clip, tmp_path / "shared.ath", **options).bytes

    def none(settings, trials):
        return settings

    monkeypatch.setitem(search.BY_NAME, "best_bases", none)
    monkeypatch.setitem(search.CHOICES, none, "time bases")
    monkeypatch.setattr(learned_bases, "candidates", lambda settings, trials: [])
    assert shared < 0.9 * athcodec.encode(clip, tmp_path / "waves.ath", **options).bytes


def test_time_bases_do_not_describe_the_rounding_of_the_rest_pose(tmp_path, monkeypatch):
    def size() -> int:
        return athcodec.encode(hit_by_a_gust(), tmp_path / "a.ath", rel_error=3e-3, ladder="none").bytes

    learned_before_rounding = size()
    monkeypatch.setattr(CodedPrelude, "uncoded_plan", property(lambda prelude: prelude.plan))
    assert learned_before_rounding < 0.95 * size()


def sum_of_shapes(count: int = 5, side: int = 12, frames: int = 120) -> athcodec.MotionClip:
    """A sheet that bends far by smooth shapes, whose weights walk at random."""
    rng, (x, y) = np.random.default_rng(3), np.meshgrid(*(np.linspace(0, 1, side),) * 2, indexing="ij")
    waves = [np.sin((1 + i) * x + (2 - i / 2) * y + i) * x for i in range(count)]
    shapes = np.stack(waves)[..., None] * rng.normal(size=(count, 1, 1, 3))
    weights = 0.03 * np.cumsum(rng.normal(size=(frames, count)), axis=0)
    rest = np.stack([x, y, 0 * x], axis=-1)
    return athcodec.MotionClip((rest + np.tensordot(weights, shapes, 1)).reshape(frames, -1, 3), np.arange(frames) / 30)


@pytest.mark.parametrize("bound", [1e-3, 1e-5])
def test_a_sum_of_a_few_shapes_takes_less_than_shapes_and_weights_do_as_short_integers(bound, tmp_path):
    clip, count = sum_of_shapes(), 5
    short_integers = 2 * count * (3 * clip.vertex_count + clip.frame_count)
    summary = athcodec.encode(clip, tmp_path / "a.ath", rel_error=bound, ladder="none")
    assert summary.bytes < short_integers
    assert summary.chunk_bytes["AFFINES"] < 0.05 * summary.bytes, "maps of coarse stages have a small share"


def test_branches_whose_bending_turns_nothing_make_a_sum_of_shapes_smaller(tmp_path):
    def size(**without) -> int:
        plan = encoding.draft(clip, rel_error=1e-4, ladder="none", **without)
        return encoding.write(clip, plan, encoding.code_segments(clip, plan, [0]), tmp_path / "a.ath").bytes

    clip = sum_of_shapes(side=9, frames=80)
    assert size() < 0.8 * size(without=frozenset({Feature.STILL}))


@pytest.fixture
def learned_everywhere(monkeypatch):
    def learned(settings, trials):
        return replace(settings, learned_bases=(True,) * settings.stages)

    monkeypatch.setitem(search.BY_NAME, "best_bases", learned)
    monkeypatch.setitem(search.CHOICES, learned, "time bases")


def test_a_layer_whose_basis_needs_fewer_rows_than_the_one_before_it_is_decoded(
    tmp_path, learned_everywhere, monkeypatch
):
    monkeypatch.setattr(layers, "basis_ratio", lambda plan, settings, ratio: 100.0 / ratio)
    clip, path = hit_by_a_gust(), tmp_path / "layers.ath"
    athcodec.encode(clip, path, rel_error=1e-4, attributes="none", ladder=(1e-2, 1e-3))
    with athcodec.open(path, strict=True) as decoder:
        for level in decoder.levels:
            error = np.linalg.norm(decoder.positions(level=level.level) - clip.block(0, clip.frame_count), axis=2)
            assert error.max() <= level.max_error
