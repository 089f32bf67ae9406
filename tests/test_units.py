"""Units, axes, lengths and sizes as people write them, on the command line and in Python."""

from __future__ import annotations

import io

import h5py
import numpy as np
import pytest
from plants import plant

import athcodec
from athcodec import cli
from athcodec.errors import BoundError, ClipError, GuessWarning
from athcodec.motion.units import AXES, METRES, METRES_PER_UNIT, parse_length, parse_size

STEM = np.zeros((12, 20, 3), np.float32)
STEM[..., 1] = np.linspace(0, 2, 20)
STEM[..., 0] = 0.1 * np.sin(np.arange(12))[:, None] * STEM[..., 1] ** 2
BRANCH = {"vertex_branch": [0] * 20, "branch_parent": [-1], "effort": "fast"}
LISTS = {"unit": "m, cm, mm, km, in, ft", "up_axis": "x, y, z"}


def stem_file(path, **scene):
    """An HDF5 file of the stem with these attributes."""
    with h5py.File(path, "w") as file:
        file["positions"] = STEM
        file["vertex_branch"], file["branch_parent"] = np.zeros(20, int), [-1]
        file.attrs.update(scene)
    return path


@pytest.mark.parametrize(
    "text, scene_unit, expected",
    [
        ("1mm", "m", 0.001),
        ("1mm", "mm", 1.0),
        ("0.5cm", "m", 0.005),
        ("0.5 cm", "mm", 5.0),
        ("3in", "mm", 76.2),
        ("1ft", "in", 12.0),
        (".1km", "cm", 1e4),
        ("1mm", "Meters", 0.001),
        ("1mm", "centimetre", 0.1),
        ("2.54cm", "inches", 1.0),
        ("1ft", "Feet", 1.0),
    ],
)
def test_a_length_is_converted_to_the_unit_of_the_scene(text, scene_unit, expected):
    assert parse_length(text).in_scene_units(scene_unit) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("unit", METRES)
def test_a_length_in_the_scenes_own_unit_is_exact(unit):
    assert parse_length(f"0.1{unit}").in_scene_units(unit) == 0.1


@pytest.mark.parametrize("scene_unit", [None, "", "m", "furlong", 5])
def test_a_length_without_a_unit_is_in_scene_units_whatever_they_are(scene_unit):
    assert parse_length("2e-3").in_scene_units(scene_unit) == 2e-3


@pytest.mark.parametrize(
    "scene_unit, message", [(None, "without a unit"), ("", "without a unit"), ("furlong", "a clip in 'furlong'")]
)
def test_a_unit_needs_a_clip_that_says_its_own(scene_unit, message):
    with pytest.raises(BoundError, match=f"1mm .*{message}"):
        parse_length("1mm").in_scene_units(scene_unit)


@pytest.mark.parametrize("text", ["", "mm", "1e", "-1mm", "1 mm 2", "1yd", "1MM", "nan", "inf", "1e999", "1,5mm"])
def test_what_is_no_length_is_refused_as_it_was_written(text):
    with pytest.raises(BoundError, match=r"length: got '" + text):
        parse_length(text)


SIZES = {"50kB": 50_000, "50KB": 50_000, "1.5MB": 1_500_000, "1GB": 10**9, "1e6": 10**6}
SIZES |= {"2KiB": 2048, "1.5 MiB": 3 << 19, "1GiB": 1 << 30, "700": 700, "700B": 700}


@pytest.mark.parametrize("text, size", SIZES.items())
def test_sizes_count_1000_or_1024_bytes_by_their_unit(text, size):
    assert parse_size(text) == size


@pytest.mark.parametrize("text", ["", "kB", "0", "0.2B", "-1kB", "1mB", "1kb", "1e30", "1 TB"])
def test_what_is_no_size_is_refused_as_it_was_written(text):
    with pytest.raises(BoundError, match=r"size: got '" + text):
        parse_size(text)


# ---- units and axes that options name ----


@pytest.mark.parametrize(
    "option, value, meant",
    [
        ("unit", "furlong", ""),
        ("unit", "meter", "'m'"),
        ("unit", "Metres", "'m'"),
        ("unit", "M", "'m'"),
        ("unit", "inches", "'in'"),
        ("unit", b"cm", "'cm'"),
        ("unit", 0.01, ""),
        ("up_axis", "Z", "'z'"),
        ("up_axis", "X", "'x'"),
        ("up_axis", "z-up", "'z'"),
        ("up_axis", "-y", ""),
        ("up_axis", "up", ""),
    ],
)
def test_other_units_and_axes_are_refused_with_the_list_and_what_was_meant(option, value, meant, tmp_path, capsys):
    hint = f"; did you mean {meant}\\?$" if meant else "$"
    message = f"^{option}: got {value!r}, expected one of {LISTS[option]}{hint}"
    path = stem_file(tmp_path / "stem.h5")
    for call in (athcodec.encode, athcodec.read):
        with pytest.raises(ClipError, match=message):
            call(STEM if call is athcodec.encode else path, **{option: value})
    with pytest.raises(ClipError, match=message):
        athcodec.encode(path, io.BytesIO(), **{option: value})
    if isinstance(value, str) and not value.startswith("-"):
        with pytest.raises(SystemExit):
            cli.main(["encode", str(path), str(tmp_path / "a.ath"), f"--{option.replace('_', '-')}", value])
        assert LISTS[option] in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("unit", METRES)
@pytest.mark.parametrize("axis", AXES)
def test_every_listed_unit_and_axis_is_stored(unit, axis):
    with athcodec.open(athcodec.encode(STEM, unit=np.str_(unit), up_axis=axis, **BRANCH)) as stem:
        assert stem.metadata == {"unit": unit, "up_axis": axis}


@pytest.mark.parametrize("stated, unit", [("Meters", "m"), ("centimetre", "cm"), ("FEET", "ft"), (b"inches", "in")])
def test_a_unit_that_a_source_writes_in_full_is_stored_as_its_symbol(stated, unit, tmp_path):
    path = stem_file(tmp_path / "stem.h5", unit=stated, up_axis="Z")
    with athcodec.read(path) as clip:
        assert clip.metadata == {"unit": unit, "up_axis": "z"}
    clip = athcodec.MotionClip(STEM, np.arange(12), metadata={"unit": stated if unit != "in" else "inches"})
    with athcodec.open(
        athcodec.encode(clip.replace(vertex_branch=[0] * 20, branch_parent=[-1]), effort="fast")
    ) as stem:
        assert stem.metadata == {"unit": unit}


@pytest.mark.parametrize("stated", [{"unit": "furlong"}, {"unit": 0.3}, {"up_axis": "up"}], ids=str)
def test_a_source_with_an_unknown_unit_or_axis_takes_a_word_on_what_is_meant(stated, tmp_path):
    [(option, value)] = stated.items()
    meant = {"unit": "cm", "up_axis": "z"}[option]
    with h5py.File(stem_file(tmp_path / "stem.h5", **stated)) as file:
        np.savez(tmp_path / "stem.npz", positions=file["positions"], **stated)
    for path in (tmp_path / "stem.h5", tmp_path / "stem.npz"):
        with pytest.raises(ClipError, match=rf"{option}: got {value!r}, expected one of {LISTS[option]}; --.* says"):
            athcodec.read(path)
        with pytest.warns(GuessWarning, match=f"got {value!r}.*taken for '{meant}'"):
            clip = athcodec.read(path, **{option: meant})
        assert clip.metadata == {option: meant} and np.array_equal(clip.block(0, 12), STEM)
        clip.close()
    clip = athcodec.MotionClip(STEM, np.arange(12), metadata=stated, vertex_branch=[0] * 20, branch_parent=[-1])
    with pytest.raises(ClipError, match=f"{option}: got {value!r}, expected one of {LISTS[option]}"):
        athcodec.encode(clip)


def test_files_that_hold_an_unknown_unit_are_decoded_with_it(tmp_path, any_unit):
    clip = athcodec.MotionClip(STEM, np.arange(12) / 24, [0] * 20, [-1], metadata={"unit": "furlong", "up_axis": "up"})
    data = athcodec.encode(clip, host_rest=True, effort="fast")
    with athcodec.open(data, host_mesh=stem_file(tmp_path / "stem.h5")) as stem:
        assert stem.metadata == clip.metadata and np.abs(stem[:] - STEM).max() < 0.001 and "furlong" in repr(stem)
        assert stem.level_within(1.0) == 0
        with pytest.raises(BoundError, match="got 5cm for a clip in 'furlong'"):
            stem.level_within("5cm")
        athcodec.write(stem, tmp_path / "again.h5")
    with h5py.File(tmp_path / "again.h5") as again:
        assert again.attrs["unit"] == "furlong"


def test_a_clip_whose_unit_is_a_number_of_metres_is_converted_and_keeps_it_without_attributes(tmp_path):
    path = stem_file(tmp_path / "stem.h5", **{METRES_PER_UNIT: 0.9144})
    with athcodec.read(path, unit="cm") as clip:
        assert clip.metadata == {"unit": "cm"}
        assert np.allclose(clip.block(0, 12), 91.44 * STEM, rtol=1e-6, atol=0)
    with athcodec.open(athcodec.encode(path, lossless=True, effort="fast")) as stem:
        athcodec.write(stem, tmp_path / "stem.glb")
    with athcodec.read(tmp_path / "stem.glb") as metres:
        assert metres.metadata["unit"] == "m" and np.allclose(metres.block(0, 12), 0.9144 * STEM, rtol=0, atol=1e-5)
    data = athcodec.encode(path, max_error="9.144mm", attributes="none", effort="fast")
    with athcodec.open(data) as stem:
        assert stem.metadata == {METRES_PER_UNIT: 0.9144} and stem.file.max_error_bound == pytest.approx(0.01)
        assert stem.level_within("9.144mm") == stem.level_within(0.01)


# ---- lengths and sizes in Python ----


def test_lengths_and_sizes_in_python_mean_what_they_mean_on_the_command_line(tmp_path):
    path, tam = stem_file(tmp_path / "stem.h5", unit="cm"), athcodec.Thresholds("0.1mm", 2, "1mm", 3)
    words = "--max-error 0.02mm --rest-error 0.01mm --tam 0.1mm,2,1mm,3 --effort fast"
    assert cli.main(["encode", str(path), str(tmp_path / "a.ath"), *words.split()]) == 0
    options = {"max_error": "0.02mm", "rest_error": "0.01mm", "tam": tam, "effort": "fast"}
    assert athcodec.encode(path, **options) == (tmp_path / "a.ath").read_bytes()
    plain = {
        "max_error": 0.002,
        "rest_error": parse_length("0.001cm"),
        "tam": athcodec.Thresholds(0.1 * 0.1, 2, 0.1, 3),
    }
    assert athcodec.encode(path, **options | plain) == (tmp_path / "a.ath").read_bytes()
    assert athcodec.encode(STEM, target_size="1kB", **BRANCH) == athcodec.encode(STEM, target_size=1000.0, **BRANCH)
    with athcodec.read(path, max_memory="1MB") as clip:
        assert athcodec.build_ath(clip, max_error="1mm").thresholds == athcodec.Thresholds(0.1, 0, 0.1, 0)


def test_levels_and_shorter_files_are_asked_for_by_lengths_and_sizes_with_units(tmp_path):
    path = tmp_path / "plant.ath"
    clip = plant(seed=3, branches=12, frames=20)
    clip.metadata = {"unit": "m"}
    athcodec.encode(clip, path, rel_error=1e-4, effort="fast")
    with athcodec.open(path) as tree:
        for level in tree.levels:
            text = np.str_(f"{level.max_error * 1000:.17g}mm")
            assert tree.level_within(text) == tree.file.level_within(level.max_error * 1.0000001) <= level.level
        assert tree.level_for("400cm", 0.8, 1080) == tree.level_for(4.0, 0.8, 1080)
        with pytest.raises(TypeError, match="level_within.*returns the level for a length"):
            tree.at_level("5cm")
        middle = tree.levels[1]
    sizes = [athcodec.truncate(path, tmp_path / "a.ath", 1)]
    sizes.append(athcodec.truncate(path, tmp_path / "a.ath", max_error=f"{middle.max_error * 100.0001:.17g}cm"))
    sizes.append(athcodec.truncate(path, tmp_path / "a.ath", target_size=f"{sizes[0]}B"))
    assert sizes == sizes[:1] * 3


@pytest.mark.parametrize("value", ["1furlong", "", "-1mm", "mm", "1MM"])
def test_text_that_is_no_length_is_refused_by_every_function_under_the_name_of_the_parameter(value):
    data = athcodec.encode(STEM, unit="m", **BRANCH)
    with athcodec.open(data) as stem:
        for name, call in (
            ("max_error", lambda: athcodec.encode(STEM, max_error=value, unit="m", **BRANCH)),
            ("rest_error", lambda: athcodec.encode(STEM, rest_error=value, unit="m", **BRANCH)),
            ("threshold xi", lambda: athcodec.Thresholds(1, 0, value, 0)),
            ("max_error", lambda: stem.level_within(value)),
            ("distance", lambda: stem.level_for(value, 0.8, 1080)),
        ):
            with pytest.raises(BoundError, match=f"^{name}: got '{value}', expected a number in scene units or one"):
                call()


@pytest.mark.parametrize("value", [True, [1], b"1mm", (1, "mm"), {}])
def test_what_is_neither_text_nor_a_number_is_no_length(value):
    with pytest.raises(TypeError, match="^max_error: got .* expected a number such as 0.01, or text such as"):
        athcodec.encode(STEM, max_error=value, **BRANCH)
