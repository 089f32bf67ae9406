"""Several clips of one plant in one file: found by name, each as close to its source as alone, smaller than apart;
loops without a jump."""

from __future__ import annotations

import numpy as np
import pytest
from plants import distance

import athcodec
from athcodec import exporters
from athcodec.cli import main
from athcodec.decoding.clip_view import ClipView
from athcodec.encoding import code_segments, draft, write
from athcodec.errors import BoundError, ClipError, ClipUnavailable
from athcodec.motion.clip import ClipRange


def part(clip: athcodec.MotionClip, start: int, stop: int) -> athcodec.MotionClip:
    return clip.replace(positions=clip.block(start, stop), time=clip.time[: stop - start])


def test_each_clip_is_found_by_its_name_and_keeps_the_bound(medley_clips, medley_ath):
    with athcodec.open(medley_ath, strict=True) as decoder:
        decoder.file.check()
        assert [clip.name for clip in decoder.file.clips] == list(medley_clips)
        for name, source in medley_clips.items():
            played = decoder.play(name)
            assert played.frame_count == source.frame_count and np.array_equal(played.time, source.time)
            assert distance(played.positions(), source.block(0, source.frame_count)) <= decoder.file.max_error_bound
            assert played.clip.loop == any(clip_range.loop for clip_range in source.clip_ranges)
            assert played.metadata["from"] == source.metadata["from"] and played.metadata["unit"] == "m"
            with athcodec.open(medley_ath, clip=name) as alone:
                assert np.array_equal(alone.positions(-1), played.positions(source.frame_count - 1))


def test_errors_of_a_clip_are_its_own_at_every_level(medley_clips, medley_ath):
    with athcodec.open(medley_ath) as decoder:
        for name, source in medley_clips.items():
            played, reference = decoder.play(name), source.block(0, source.frame_count)
            for level in played.levels:
                measured = distance(played.positions(level=level.level), reference)
                assert measured <= level.max_error * (1 + 1e-6) and level.max_error <= measured * (1 + 1 / 31)
        assert [level["max_error"] for level in decoder.file.info()["levels"]] == [
            max(decoder.play(name).levels[level].max_error for name in medley_clips)
            for level in range(decoder.file.level_count)
        ]


def test_decoders_of_two_clips_serve_at_the_same_time(medley_clips, medley_ath):
    names = list(medley_clips)
    with athcodec.open(medley_ath) as decoder:
        whole = {name: decoder.play(name).positions() for name in names}
        blocks = [decoder.play(name).blocks() for name in (names[0], names[1])]
        for (start, one), (other_start, other) in zip(*blocks):
            assert np.array_equal(one, whole[names[0]][start : start + len(one)])
            assert np.array_equal(other, whole[names[1]][other_start : other_start + len(other)])
        with athcodec.open(medley_ath, clip=names[1]) as alone:
            assert np.array_equal(decoder.play(names[1]).affines(20).matrices, alone.affines(20).matrices)


def test_an_unknown_name_says_which_there_are(medley_ath, sample_ath):
    with pytest.raises(ClipUnavailable, match="clip: got 'gale'; expected 'calm', 'Böe', 'still', 'round'"):
        athcodec.open(medley_ath, clip="gale")
    with pytest.raises(ClipUnavailable, match="expected none, the only one has no name"):
        athcodec.open(sample_ath, clip="calm")


def test_one_file_is_smaller_than_one_for_each_clip(sample_clip, tmp_path):
    clips = {f"part{start}": part(sample_clip, start, start + 40) for start in (0, 40, 80)}
    together = athcodec.encode(athcodec.join(clips), tmp_path / "together.ath", effort="fast", rel_error=1e-3)
    apart = [
        athcodec.encode(clip, tmp_path / f"{name}.ath", effort="fast", max_error=together.max_error_bound).bytes
        for name, clip in clips.items()
    ]
    assert together.bytes < 0.6 * sum(apart)


@pytest.mark.slow
def test_the_size_does_not_depend_on_the_order_of_the_clips(sample_clip, tmp_path):
    clips, sizes = {"a": part(sample_clip, 0, 50), "b": part(sample_clip, 50, 80), "c": part(sample_clip, 80, 120)}, []
    for order in ("abc", "cba", "bca"):
        joined = athcodec.join({name: clips[name] for name in order})
        sizes.append(athcodec.encode(joined, tmp_path / "a.ath", rel_error=1e-3).bytes)
    assert max(sizes) - min(sizes) < 0.01 * max(sizes)


def test_a_large_plant_is_searched_on_a_part_of_it_in_all_its_clips(sample_clip, tmp_path, monkeypatch):
    clips = {"a": part(sample_clip, 0, 40), "b": part(sample_clip, 40, 120)}
    whole = athcodec.encode(athcodec.join(clips), tmp_path / "a.ath", rel_error=1e-3)
    monkeypatch.setattr("athcodec.encoding.search.sample.LARGE", 500)
    monkeypatch.setattr("athcodec.encoding.search.sample.LEAST_SAMPLE", 200)
    searched = athcodec.encode(athcodec.join(clips), tmp_path / "b.ath", rel_error=1e-3)
    assert searched.max_error_bound == whole.max_error_bound and searched.bytes < 1.05 * whole.bytes
    with athcodec.open(tmp_path / "b.ath", strict=True) as decoder:
        for name, clip in clips.items():
            assert distance(decoder.play(name).positions(), clip.positions) <= decoder.file.max_error_bound


def test_a_cut_off_file_shows_all_clips_at_the_levels_that_are_left(medley_clips, medley_ath, tmp_path):
    shorter = tmp_path / "shorter.ath"
    athcodec.truncate(medley_ath, shorter, 1)
    with athcodec.open(shorter, strict=True) as decoder, athcodec.open(medley_ath) as full:
        assert decoder.file.level_count == 2
        for name in medley_clips:
            assert np.array_equal(decoder.play(name).positions(), full.play(name).positions(level=1))
            assert decoder.play(name).clip == full.play(name).clip


def test_the_error_at_the_seam_is_how_far_off_the_step_over_it_is(medley_clips, medley_ath):
    with athcodec.open(medley_ath) as decoder:
        for name in ("calm", "round"):
            source, played = medley_clips[name], decoder.play(name)
            last, first = source.block(source.frame_count - 1, source.frame_count)[0], source.block(0, 1)[0]
            for level, stated in enumerate(played.clip.seam_errors):
                shown = played.positions(0, level, np.float64) - played.positions(-1, level, np.float64)
                assert stated == pytest.approx(distance(shown, np.float64(first) - last), rel=1e-5)
            assert played.clip.seam_errors[-1] <= 2 * decoder.file.max_error_bound
        assert decoder.play("still").clip.seam_errors == ()


def test_a_blended_loop_goes_on_where_its_last_frame_ends(sample_clip):
    loop = athcodec.looped(sample_clip, 20)
    source, frames = sample_clip.block(0, 120), loop.block(0, 100)
    assert loop.frame_count == 100 and loop.clip_ranges[0].loop and loop.metadata["loop_blend"] == 20
    assert np.array_equal(frames[20:], source[20:100]), "what is not blended is the source's"
    assert np.array_equal(frames[0], source[100]), "the first frame is what followed the last"
    steps = np.linalg.norm(np.diff(source.astype(np.float64), axis=0), axis=2).max()
    assert distance(frames[-1], frames[0]) <= steps
    assert np.linalg.norm(np.diff(frames.astype(np.float64), axis=0), axis=2).max() < 2 * steps
    for start, stop in ((0, 100), (5, 30), (19, 21), (20, 40), (99, 100)):
        assert np.array_equal(loop.block(start, stop), frames[start:stop])


@pytest.mark.parametrize("blend", [-1, 41])
def test_a_blend_that_is_too_long_is_refused(sample_clip, blend):
    with pytest.raises(ClipError, match=f"loop: got {blend} frames to blend, expected 0 to 40"):
        athcodec.looped(sample_clip, blend)


def test_lossless_clips_are_joined_without_loss(medley_clips, tmp_path):
    path = tmp_path / "lossless.ath"
    athcodec.encode(athcodec.join(medley_clips), path, lossless=True, segment_frames=16)
    with athcodec.open(path, strict=True) as decoder:
        for name, source in medley_clips.items():
            played = decoder.play(name)
            assert np.array_equal(played.positions(), source.block(0, source.frame_count))
            assert played.clip.seam_errors[-1:] in ((), (0.0,))


def test_the_file_is_the_same_when_coded_in_steps_or_with_any_number_of_jobs(medley_clips, tmp_path):
    """A process that codes some of the segments joins them to ones that it does not hand over."""
    clip, options = athcodec.join(medley_clips), {"rel_error": 1e-4, "segment_frames": 16, "effort": "fast"}
    plan = draft(clip, **options)
    segments = [own for s in reversed(range(plan.segment_count)) for own in code_segments(clip, plan, [s])]
    write(clip, plan, segments, tmp_path / "steps.ath")
    athcodec.encode(clip, tmp_path / "one.ath", jobs=1, **options)
    athcodec.encode(clip, tmp_path / "some.ath", **options)
    one, some, steps = ((tmp_path / f"{name}.ath").read_bytes() for name in ("one", "some", "steps"))
    assert one == some == steps


@pytest.mark.slow
def test_a_target_size_is_that_of_all_clips_and_branches_are_found_for_all(medley_clips, tmp_path):
    bare = {
        name: clip.replace(vertex_branch=None, branch_parent=None, stem_index=None)
        for name, clip in medley_clips.items()
    }
    made = athcodec.encode(athcodec.join(bare), tmp_path / "bare.ath", target_size=12_000)
    assert 0.9 * 12_000 <= made.bytes <= 12_000
    with pytest.raises(BoundError):
        athcodec.encode(athcodec.join(bare), tmp_path / "bare.ath", target_size=100)


def test_clips_of_other_plants_are_refused_by_what_differs(medley_clips):
    calm = medley_clips["calm"]
    bare = {"branch_parent": None, "vertex_branch": None, "stem_index": None}
    short = {"positions": calm.block(0, 9)[:, :-1], "time": calm.time[:9], "rest": calm.rest[:-1]}
    other = {
        "vertices": (short | bare | {"clip_ranges": ()}, "b: got .* vertices, expected"),
        "rest": ({"rest": calm.rest + 1}, "b: got another rest pose than a .vertex"),
        "faces": ({"faces": np.array([[0, 1, 2]])}, "b: got other faces than a"),
        "attributes": ({"attributes": {"radius": np.ones(3)}}, "b: got another attribute radius than a"),
        "branches": (bare, "b: got other vertex_branch"),
        "clip_ranges": (
            {"clip_ranges": (ClipRange("x", 10), ClipRange("y", 10))},
            "b: got 2 clips in one, expected a single one",
        ),
    }
    for changes, message in other.values():
        with pytest.raises(ClipError, match=message):
            athcodec.join({"a": calm, "b": calm.replace(**changes)})


def test_a_rest_pose_that_is_only_the_first_frame_gives_way_to_a_real_one(medley_clips):
    calm, gust = medley_clips["calm"], medley_clips["Böe"]
    without = gust.replace(rest=gust.block(0, 1)[0])
    assert np.array_equal(athcodec.join({"gust": without, "calm": calm}).rest, calm.rest)
    alone = athcodec.join({"gust": without, "calm": calm.replace(rest=calm.block(0, 1)[0])})
    assert np.array_equal(alone.rest, without.rest)


@pytest.mark.parametrize("names", [("", "b"), ("a\n", "b"), ("a\x7f", "b"), ("\ud800", "b"), ("ä" * 128, "b")])
def test_names_that_cannot_be_stored_are_refused(medley_clips, names):
    with pytest.raises(ClipError, match="clip names: got"):
        athcodec.join(dict(zip(names, medley_clips.values())))


def test_more_clips_than_a_file_can_name_are_refused(medley_clips):
    with pytest.raises(ClipError, match="clips: got 256, expected at most 255"):
        athcodec.join({f"{i}": medley_clips["still"] for i in range(256)})


def test_times_run_on_within_a_clip_only(medley_clips):
    calm = medley_clips["calm"]
    joined = athcodec.join({"a": calm, "b": calm})
    assert np.array_equal(joined.time[20:], calm.time) and joined.fps == pytest.approx(calm.fps)
    time = joined.time.copy()
    time[30] = time[29]
    with pytest.raises(ClipError, match="time: frame 30 is at"):
        joined.replace(time=time)


def test_split_gives_back_what_was_joined(medley_clips):
    joined = athcodec.join(medley_clips)
    for name, clip in athcodec.split(joined).items():
        source = medley_clips[name]
        assert np.array_equal(clip.block(0, clip.frame_count), source.block(0, source.frame_count))
        assert np.array_equal(clip.time, source.time) and clip.metadata == source.metadata
        assert clip.clip_ranges[0].name == name
        assert clip.clip_ranges[0].loop == any(clip_range.loop for clip_range in source.clip_ranges)
    again = athcodec.join(athcodec.split(joined))
    assert again.clip_ranges == joined.clip_ranges and again.metadata == joined.metadata
    assert np.array_equal(again.block(15, 70), joined.block(15, 70))
    assert athcodec.split(medley_clips["still"]) == {"": medley_clips["still"]}


def test_a_clip_view_of_all_clips_is_what_each_is(medley_clips, medley_ath):
    with athcodec.open(medley_ath) as decoder:
        view = ClipView(decoder, 1, all_clips=True)
        frames = np.concatenate([decoder.play(name).positions(level=1) for name in medley_clips])
        assert view.clip_ranges == athcodec.join(medley_clips).clip_ranges
        assert np.array_equal(np.concatenate([block for _, block in view.blocks()]), frames)
        assert [start for start, _ in view.blocks()][:3] == [0, 10, 20]
        for start, stop in ((0, 90), (19, 21), (57, 58), (3, 5)):
            assert np.array_equal(view.block(start, stop), frames[start:stop])
        assert np.array_equal(view.affines(25).matrices, decoder.play("Böe").affines(5, 1).matrices)
        assert view.max_error == max(decoder.play(name).levels[1].max_error for name in medley_clips)
        assert not ClipView(decoder, 1, range(3)).clip_ranges[0].loop, "some frames of a loop are none"


@pytest.mark.parametrize(
    "kind", [form for form in exporters.FORMATS if not form.holds_several], ids=lambda kind: kind.name
)
def test_formats_of_one_clip_refuse_several_and_write_nothing(kind, medley_clips, medley_ath, tmp_path):
    path = tmp_path / f"a{kind.suffixes[0]}"
    with athcodec.open(medley_ath) as decoder:
        for several in (athcodec.join(medley_clips), ClipView(decoder, all_clips=True)):
            with pytest.raises(ClipError, match="several clips, calm, Böe, still, round; expected one .*--clip.*glb"):
                athcodec.write(several, path)
        assert list(tmp_path.iterdir()) == []
        athcodec.write(medley_clips["calm"], path)
        athcodec.write(ClipView(decoder), path.with_stem("b"))


@pytest.mark.parametrize("suffix", [".h5", ".npz"])
def test_name_and_loop_of_a_clip_go_through_a_file_of_the_schema(suffix, medley_ath, tmp_path):
    path = tmp_path / f"a{suffix}"
    for name, loop in (("calm", True), ("Böe", False)):
        with athcodec.open(medley_ath, clip=name) as decoder:
            athcodec.write(ClipView(decoder), path)
            with athcodec.read(path) as clip:
                assert clip.clip_ranges == (ClipRange(name, decoder.frame_count, loop),)
                assert clip.metadata == decoder.metadata
    assert main(["encode", str(path), str(tmp_path / "a.ath"), "--effort", "fast"]) == 0
    with athcodec.open(tmp_path / "a.ath", clip="Böe") as decoder:
        assert "clip_name" not in decoder.metadata


def test_a_loop_that_was_blended_is_not_blended_again(medley_ath, tmp_path):
    source, path = str(tmp_path / "round.h5"), str(tmp_path / "round.ath")
    assert main(["decode", str(medley_ath), source, "--clip", "round"]) == 0
    assert main(["encode", source, path]) == 0 and main(["verify", path, "--against", source]) == 0


# ---- the command line ----


@pytest.fixture(scope="module")
def sources(medley_clips, tmp_path_factory):
    """The motions as files, before any was made a loop."""
    folder = tmp_path_factory.mktemp("sources")
    for name in ("calm", "Böe"):
        athcodec.write_hdf5(medley_clips[name].replace(clip_ranges=()), folder / f"{name}.h5")
    return [str(folder / f"{name}.h5") for name in ("calm", "Böe")]


def test_files_are_joined_under_their_names_verified_and_decoded_by_name(sources, tmp_path, capsys):
    out, decoded = str(tmp_path / "oak.ath"), str(tmp_path / "calm.h5")
    assert (
        main(
            [
                "encode",
                *sources,
                "-o",
                out,
                "--names",
                "quiet,storm",
                "--loop",
                "storm",
                "--loop-blend",
                "9",
                "--effort",
                "fast",
            ]
        )
        == 0
    )
    assert "loop: storm: vertices move by up to" in capsys.readouterr().err
    assert main(["info", out]) == 0
    shown = capsys.readouterr().out
    assert "quiet" in shown and "storm" in shown and "57 frames" not in shown and "48 frames" in shown
    assert main(["verify", out, "--against", sources[0], "--against", sources[1]]) == 0
    assert "every level is as close to" in capsys.readouterr().out
    assert main(["verify", out, "--clip", "storm", "--against", sources[1]]) == 0
    assert main(["verify", out, "--clip", "storm", "--against", sources[0]]) == 1
    assert main(["verify", out, "--against", sources[0]]) == 1
    assert "got 1 sources, expected 2, one for each clip" in capsys.readouterr().err
    assert main(["decode", out, decoded]) == 1
    assert "got several clips, quiet, storm; expected one of them with --clip" in capsys.readouterr().err
    assert main(["decode", out, decoded, "--clip", "quiet"]) == 0
    with athcodec.open(out) as decoder, athcodec.read(decoded) as clip:
        assert np.array_equal(clip.block(0, 20), decoder.play("quiet").positions())


def test_a_float32_rest_pose_made_for_several_clips_is_stored_as_float32(sources, tmp_path):
    out = str(tmp_path / "oak.ath")
    assert main(["encode", *sources, "-o", out, "--rest", "first", "--exact-rest", "--effort", "fast"]) == 0
    with athcodec.open(out) as decoder:
        assert decoder.file.rest.dtype == np.float32
        with athcodec.read(sources[0], rest="first") as first:
            assert np.array_equal(decoder.file.rest, first.source_rest)


@pytest.mark.slow
def test_the_output_may_stand_behind_the_inputs_or_between_options(sources, tmp_path):
    for place, words in enumerate(
        ([*sources, "{}"], [sources[0], "--effort", "fast", "{}"], ["-o", "{}", *sources], [sources[0], "-o", "{}"])
    ):
        out = str(tmp_path / f"{place}.ath")
        assert main(["encode", *(word.format(out) for word in words)]) == 0
        with athcodec.open(out) as decoder:
            assert [clip.name for clip in decoder.file.clips] == (["calm", "Böe"] if sources[1] in words else [""])


@pytest.mark.parametrize(
    "words, message",
    [
        (["--names", "a"], "--names: got 1, expected 2, one for each clip"),
        (["--names", "a,a"], "clip 'a': got 2 of this name, expected one"),
        (["--loop", "gale"], "clip 'gale': got 0 of this name, expected one"),
        (["--loop-blend", "3"], "--loop-blend: got no clips to make loops of"),
    ],
)
def test_names_that_do_not_fit_the_inputs_are_refused(sources, tmp_path, capsys, words, message):
    assert main(["encode", *sources, str(tmp_path / "x.ath"), *words]) == 1
    assert message in capsys.readouterr().err and not (tmp_path / "x.ath").exists()
