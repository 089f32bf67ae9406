"""Lengths and sizes as they are written on a command line."""

from __future__ import annotations

import pytest

from athcodec.errors import BoundError
from athcodec.motion.units import METRES, parse_length, parse_size


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
