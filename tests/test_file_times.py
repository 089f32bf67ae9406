"""The times of files that are one motion: indices, fields, comments and names; what contradicts itself is said."""

from __future__ import annotations

import json
import re
import warnings

import numpy as np
import pytest

import athcodec
from athcodec.errors import ClipError, GuessWarning, SourceWarning
from athcodec.sources.mtg import mtg_branches
from athcodec.sources.timing import warn_of_missed

TIMES = [0.0, 0.1, 0.25, 0.3, 0.5, 0.9]
FORMATS = [".obj", ".ply", ".vtu", ".vtp", ".vtk"]

OBJ = "{comment}v 0 0 {z}\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
PLY = (
    "ply\nformat ascii 1.0\n{comment}element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 {z}\n1 0 0\n0 1 0\n3 0 1 2\n"
)
XML_POINTS = (
    '<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 {z} 1 0 0 0 1 0</DataArray></Points>'
)
VTU = (
    '<VTKFile type="UnstructuredGrid"><UnstructuredGrid>{field}<Piece NumberOfPoints="3" NumberOfCells="1">'
    + XML_POINTS
    + '<Cells><DataArray type="Int32" Name="connectivity" format="ascii">0 1 2</DataArray><DataArray type="Int32" '
    'Name="offsets" format="ascii">3</DataArray><DataArray type="UInt8" Name="types" format="ascii">5</DataArray>'
    "</Cells></Piece></UnstructuredGrid></VTKFile>"
)
VTP = (
    '<VTKFile type="PolyData"><PolyData>{field}<Piece NumberOfPoints="3" NumberOfPolys="1">'
    + XML_POINTS
    + '<Polys><DataArray type="Int32" Name="connectivity" format="ascii">0 1 2</DataArray><DataArray type="Int32" '
    'Name="offsets" format="ascii">3</DataArray></Polys></Piece></PolyData></VTKFile>'
)
VTK = (
    "# vtk DataFile Version 3.0\n{comment}\nASCII\nDATASET POLYDATA\n{field}POINTS 3 float\n0 0 {z} 1 0 0 0 1 0\n"
    "POLYGONS 1 4\n3 0 1 2\n"
)
TEXTS = {".obj": OBJ, ".ply": PLY, ".vtu": VTU, ".vtp": VTP, ".vtk": VTK}


def xml_field(value, name="TimeValue", kind="Float64"):
    return (
        f'<FieldData><DataArray type="{kind}" Name="{name}" NumberOfTuples="1" format="ascii">{value}</DataArray>'
        "</FieldData>"
    )


def legacy_field(value, name="TIME", kind="double"):
    return f"FIELD FieldData 1\n{name} 1 1 {kind}\n{value}\n"


def field_of(suffix, value, **what):
    return (legacy_field if suffix == ".vtk" else xml_field)(value, **what)


def write(path, z, field="", comment=""):
    """A triangle whose first vertex has this z."""
    path.parent.mkdir(exist_ok=True)
    path.write_text(
        TEXTS[path.suffix].format(z=z, field=field, comment=comment or ("a" if path.suffix == ".vtk" else ""))
    )
    return path


def write_all(folder, names, **what):
    return [write(folder / name, z, **{key: values[z] for key, values in what.items()}) for z, name in enumerate(names)]


def series(path, names, times):
    files = [{"name": name, "time": time} for name, time in zip(names, times)]
    path.write_text(json.dumps({"file-series-version": "1.0", "files": files}))
    return path


def pvd(path, names, times, **attributes):
    rows = [
        f'<DataSet timestep="{time}" file="{name}" '
        + " ".join(f'{key}="{values[place]}"' for key, values in attributes.items())
        + "/>"
        for place, (name, time) in enumerate(zip(names, times))
    ]
    path.write_text(f'<VTKFile type="Collection"><Collection>{"".join(rows)}</Collection></VTKFile>')
    return path


def frames_of(clip):
    """Which of the files of `write_all` the frames are."""
    return clip.block(0, clip.frame_count)[:, 0, 2].round(6).tolist()


def read(path, *texts, **options):
    """(frames, times) of a clip; each text is a pattern of one of the GuessWarnings, of which there are no others."""
    with warnings.catch_warnings(record=True, action="always") as said, athcodec.read(path, **options) as clip:
        found = frames_of(clip), clip.time.tolist()
    messages = [str(warning.message) for warning in said]
    assert len(messages) == len(texts), messages
    for text, message in zip(texts, messages):
        assert re.search(text, message), message
    return found


def close(times):
    return pytest.approx(times, abs=1e-9)


# ---- one of each kind ----


def test_a_time_in_a_field_of_the_file_is_the_time_of_its_frame(tmp_path):
    names = [f"leaf_{place:03}.vtu" for place in range(6)]
    first, *_ = write_all(tmp_path, names, field=list(map(xml_field, TIMES)))
    assert read(first) == ([0, 1, 2, 3, 4, 5], close(TIMES))


def test_a_series_file_states_the_times_named_or_beside(tmp_path):
    names = [f"leaf_{place}.obj" for place in range(6)]
    files = write_all(tmp_path, names)
    index = series(tmp_path / "leaf.obj.series", names, TIMES)
    for path in (index, files[0], files[5], tmp_path / "leaf_#.obj"):
        assert read(path) == ([0, 1, 2, 3, 4, 5], close(TIMES))


def test_decimals_in_names_are_seconds_in_the_order_of_their_value(tmp_path):
    files = write_all(tmp_path, [f"leaf_{time}.obj" for time in (0.1, 0.15, 0.2, 0.25, 0.3)])
    seconds = (
        r"leaf_0\.1\.obj: the numbers in the names, 0\.1, 0\.15, 0\.2 \.\.\., have decimals and are taken for seconds"
    )
    for path in files:
        assert read(path, seconds) == ([0, 1, 2, 3, 4], close([0, 0.05, 0.1, 0.15, 0.2]))
    assert read(files[0], fps=0.5) == ([0, 1, 2, 3, 4], close([0, 0.1, 0.2, 0.3, 0.4]))


def test_numbers_that_do_not_follow_one_another_are_said_and_the_advice_works(tmp_path):
    files = write_all(tmp_path, ["leaf_0.ply", "leaf_40.ply", "leaf_80.ply"])
    with pytest.warns(GuessWarning) as said, athcodec.read(files[0]) as clip:
        assert clip.time.tolist() == close([0, 40 / 30, 80 / 30])
    (message,) = [str(warning.message) for warning in said]
    assert "0, 40, 80, do not follow one another and are taken for frames, of which 30 are a second" in message
    rate = re.search(r"--fps RATE says how many are a second, and --fps (\S+) gives 30 files a second", message)[1]
    assert read(files[0], fps=float(rate)) == ([0, 1, 2], close([0, 1 / 30, 2 / 30]))


@pytest.mark.parametrize(
    "keys, fps, advice",
    [
        (np.array([0, 0.0125, 1 / 24]), 24, 240),
        (np.array([0, 1.234, 1.238, 3]), 30, 500),
        (np.array([1, 1.25, 1.5, 7.125]), 2, 8),
        (np.array([1 / 3, 0.5]), 1, 6),  # No key of the stage is on a frame: its frames begin at a whole one.
    ],
)
def test_the_rate_that_is_advised_is_plain_and_has_frames_at_the_keys(keys, fps, advice):
    start = keys[0] if keys[0] == round(keys[0] * fps) / fps else 0.0
    missed = np.abs((keys - start) * fps - np.round((keys - start) * fps)) > 1e-3
    with pytest.warns(GuessWarning, match=rf"--fps {advice} has ") as said:
        warn_of_missed(keys, missed, fps, "a.usda")
    if "a frame at each" in str(said[0].message):
        places = (keys - start) * advice
        assert np.abs(places - np.round(places)).max() < 1e-9


def test_parts_of_one_time_in_a_pvd_are_joined(tmp_path):
    write_all(tmp_path, ["leaf_0.vtu", "leaf_1.vtu", "stem_0.vtp", "stem_1.vtp"])
    index = pvd(
        tmp_path / "a.pvd",
        ["leaf_0.vtu", "stem_0.vtp", "leaf_1.vtu", "stem_1.vtp"],
        [0, 0, 0.5, 0.5],
        group=["leaf", "stem"] * 2,
    )
    with athcodec.read(index) as clip:
        assert clip.block(0, 2)[:, [0, 3], 2].tolist() == [[0, 2], [1, 3]] and clip.time.tolist() == [0, 0.5]
        assert clip.faces.tolist() == [[0, 1, 2], [3, 4, 5]] and clip.metadata["part_names"] == ["leaf", "stem"]
        assert clip.attributes["part_vertex_counts"].tolist() == [3, 3]


def test_what_a_mesh_or_a_plant_says_and_is_not_read_is_named(tmp_path):
    with write(tmp_path / "a.obj", 0).open("a") as file:
        file.write("vn 0 0 1\nc_interp on\n")
    write(tmp_path / "a.ply", 0, comment="comment TextureFile a.png\n")
    for path, names in ((tmp_path / "a.obj", ["vn", "c_interp"]), (tmp_path / "a.ply", ["TextureFile"])):
        with athcodec.read(path) as clip:
            assert clip.not_read == {"statement": names}
    with (tmp_path / "a.obj").open("a") as file:
        file.write("curv2 1 2 3\n")
    with pytest.warns(SourceWarning, match="not read: curve or surface curv2"):
        athcodec.read(tmp_path / "a.obj").close()
    plant = tmp_path / "a.mtg"
    plant.write_text("CODE: FORM-A\nCLASSES:\n$\t0\nP\t1\nMTG:\nTOPO\tdiam\n/P1\t1\n*\t2\n^<P2\t3\n")
    clip = athcodec.MotionClip(np.zeros((1, 2, 3)), np.zeros(1))
    with pytest.warns(SourceWarning, match=r"not read: features diam; 1 row of later dates \(\*\)"):
        assert mtg_branches(plant, clip)[0].tolist() == [0, 0]


def test_numbered_files_of_a_format_that_has_all_frames_in_one_are_said(tmp_path):
    for frame in range(2):
        np.savez(tmp_path / f"leaf_{frame}.npz", positions=np.zeros((1, 3, 3)), time=np.zeros(1))
    with pytest.warns(GuessWarning, match=r"leaf_0\.npz: read as one frame, without leaf_1\.npz"):
        athcodec.read(tmp_path / "leaf_0.npz").close()


# ---- times in files ----


@pytest.mark.formats
@pytest.mark.parametrize("suffix", [".vtu", ".vtp", ".vtk"])
@pytest.mark.parametrize("name", ["TimeValue", "TIME", "time"])
def test_fields_for_the_time_are_read_in_every_format(tmp_path, suffix, name):
    fields = [field_of(suffix, time, name=name) for time in TIMES]
    files = write_all(tmp_path, [f"leaf_{place}{suffix}" for place in range(6)], field=fields)
    with athcodec.read(files[2]) as clip:
        assert clip.time.tolist() == close(TIMES) and clip.not_read == {}


@pytest.mark.formats
def test_times_of_float32_give_the_rate_that_they_round(tmp_path):
    times = [repr(float(np.float32(frame / 24))) for frame in range(5)]
    fields = [xml_field(time, kind="Float32") for time in times]
    files = write_all(tmp_path, [f"leaf_{place}.vtu" for place in range(5)], field=fields)
    with athcodec.read(files[0]) as clip:
        assert clip.metadata["fps"] == 24 and clip.time.tolist() == [frame / 24 for frame in range(5)]


@pytest.mark.formats
@pytest.mark.parametrize("suffix", [".vtu", ".vtk"])
def test_times_that_are_in_another_order_than_the_names_give_the_order(tmp_path, suffix):
    fields = [field_of(suffix, time) for time in (0.4, 0.2, 0.0)]
    files = write_all(tmp_path, [f"leaf_{place}{suffix}" for place in range(3)], field=fields)
    assert read(files[0], "frames are in the order of the field T") == ([2, 1, 0], close([0, 0.2, 0.4]))


@pytest.mark.formats
@pytest.mark.parametrize("fields", [["", "0.5", "0.9"], ["0", "0", "0"], ["0.5", "0.5", "0.9"], ["nan", "1", "2"]])
def test_fields_that_give_no_time_for_each_file_are_said(tmp_path, fields):
    files = write_all(
        tmp_path, [f"leaf_{place}.vtu" for place in range(3)], field=[value and xml_field(value) for value in fields]
    )
    with pytest.warns(GuessWarning, match="the field TimeValue .* states no time for each of the 3 files"):
        with athcodec.read(files[0]) as clip:
            assert clip.time.tolist() == close([0, 1 / 30, 2 / 30])
            assert clip.not_read == {"field": ["TimeValue (field data)"]}


@pytest.mark.formats
@pytest.mark.parametrize("suffix, kind", [(".vtu", "Int32"), (".vtk", "int")])
@pytest.mark.parametrize("name", ["TimeStep", "CYCLE"])
def test_counted_steps_are_no_times_and_are_named(tmp_path, suffix, kind, name):
    fields = [field_of(suffix, step, name=name, kind=kind) for step in (0, 40, 80)]
    files = write_all(tmp_path, [f"leaf_{place}{suffix}" for place in range(3)], field=fields)
    with pytest.warns(GuessWarning, match=rf"the field {name} \(0, 40, 80\) states no time"):
        with athcodec.read(files[0]) as clip:
            assert clip.time.tolist() == close([0, 1 / 30, 2 / 30])
            assert clip.not_read == {"field": [f"{name} (field data)"]}


@pytest.mark.formats
def test_a_field_called_for_steps_that_has_decimals_is_the_time_and_is_said(tmp_path):
    fields = [xml_field(time, name="TimeStep") for time in TIMES]
    files = write_all(tmp_path, [f"leaf_{place}.vtp" for place in range(6)], field=fields)
    text = "the field TimeStep, a field that may count steps, is taken for the time: 0, 0.1, 0.25 "
    assert read(files[0], text) == ([0, 1, 2, 3, 4, 5], close(TIMES))


@pytest.mark.formats
def test_other_fields_are_named(tmp_path):
    fields = [xml_field(time) + xml_field(7, name="wind") for time in TIMES]
    files = write_all(tmp_path, [f"leaf_{place}.vtp" for place in range(6)], field=fields)
    with athcodec.read(files[0]) as clip:
        assert clip.time.tolist() == close(TIMES) and clip.not_read == {"field": ["wind (field data)"]}


@pytest.mark.formats
@pytest.mark.parametrize(
    "suffix, comment",
    [
        (".obj", "# time = {}\n"),
        (".ply", "comment Time: {} s\n"),
        (".ply", "obj_info t={}\n"),
        (".vtk", "leaf, time {}"),
    ],
)
def test_times_in_comments_are_taken_and_said(tmp_path, suffix, comment):
    files = write_all(
        tmp_path, [f"leaf_{place}{suffix}" for place in range(6)], comment=[comment.format(time) for time in TIMES]
    )
    assert read(files[0], "a comment, for which there is no rule, is taken for the time: 0, 0.1, 0.25 ") == (
        [0, 1, 2, 3, 4, 5],
        close(TIMES),
    )


@pytest.mark.formats
@pytest.mark.parametrize(
    "text", ["time 12:30:01", "Time 2024-03-31", "runtime 3", "timestamp 17", "t 5", "export time: 3", "time 3.4.5"]
)
def test_other_numbers_in_comments_are_no_times(tmp_path, text):
    files = write_all(tmp_path, ["a_1.obj", "a_2.obj"], comment=[f"# {text}\n", f"# {text}1\n"])
    assert read(files[0]) == ([0, 1], close([0, 1 / 30]))


# ---- indices ----


@pytest.mark.formats
@pytest.mark.parametrize("suffix", FORMATS)
def test_a_series_file_is_read_for_every_format(tmp_path, suffix):
    names = [f"leaf_{place}{suffix}" for place in range(6)]
    files = write_all(tmp_path, names)
    index = series(tmp_path / f"leaf{suffix}.series", names, TIMES)
    for path in (index, files[3]):
        assert read(path) == ([0, 1, 2, 3, 4, 5], close(TIMES))


@pytest.mark.formats
@pytest.mark.parametrize("make, name", [(pvd, "leaf.pvd"), (series, "leaf.vtu.series")])
def test_an_index_in_the_folder_above_is_found(tmp_path, make, name):
    names = [f"leaf/leaf_{place}.vtu" for place in range(3)]
    files = write_all(tmp_path, names)
    make(tmp_path / name, names, [1.0, 2.0, 4.5])
    assert read(files[1]) == ([0, 1, 2], close([0, 1, 3.5]))


@pytest.mark.formats
def test_names_that_json_and_xml_escape_are_found(tmp_path):
    for place, (make, index) in enumerate([(series, "a.vtu.series"), (pvd, "a.pvd")]):
        folder = tmp_path / str(place)
        names = [f"blätt&er_{frame}.vtu" for frame in range(2)]
        files = write_all(folder, names)
        make(folder / index, [name.replace("&", "&amp;") if make is pvd else name for name in names], [0, 2.0])
        assert read(files[0]) == ([0, 1], close([0, 2]))


@pytest.mark.formats
@pytest.mark.parametrize("make, name", [(pvd, "leaf.pvd"), (series, "leaf.vtu.series")])
def test_entries_of_an_index_come_in_the_order_of_time_and_once(tmp_path, make, name):
    names = [f"leaf_{place}.vtu" for place in range(3)]
    write_all(tmp_path, names)
    index = make(tmp_path / name, [*names[::-1], names[0]], [2.0, 0.5, 0.1, 0.1])
    assert read(index) == ([0, 1, 2], close([0, 0.4, 1.9]))


@pytest.mark.formats
@pytest.mark.parametrize("make, name", [(pvd, "leaf.pvd"), (series, "leaf.vtu.series")])
def test_two_files_at_one_time_are_refused_by_their_names(tmp_path, make, name):
    names = [f"leaf_{place}.vtu" for place in range(3)]
    write_all(tmp_path, names)
    with pytest.raises(
        ClipError, match=r"got leaf_1\.vtu and leaf_2\.vtu at the time 0\.5, expected one file; .*part="
    ):
        athcodec.read(make(tmp_path / name, names, [0, 0.5, 0.5]))


@pytest.mark.formats
def test_files_that_an_index_lists_and_that_are_not_there_are_named(tmp_path):
    names = [f"leaf_{place}.vtu" for place in range(4)]
    files = write_all(tmp_path, names)
    index = pvd(tmp_path / "leaf.pvd", names, [0, 0.1, 0.3, 0.7])
    files[1].unlink()
    with (
        pytest.warns(SourceWarning, match=r"not read: file that is not there leaf_1\.vtu"),
        athcodec.read(index) as clip,
    ):
        assert frames_of(clip) == [0, 2, 3] and clip.time.tolist() == close([0, 0.3, 0.7])
    for file in files:
        file.unlink(missing_ok=True)
    with pytest.raises(ClipError, match=r"got 4 files that are not there, such as leaf_0\.vtu"):
        athcodec.read(index)


@pytest.mark.formats
def test_files_of_the_sequence_that_the_index_lacks_are_named(tmp_path):
    names = [f"leaf_{place}.vtu" for place in range(4)]
    files = write_all(tmp_path, names)
    pvd(tmp_path / "leaf.pvd", names[:3], [0, 0.1, 0.3])
    text = r"read by .*leaf\.pvd as 3 frames, without leaf_3\.vtu, which it does not list"
    assert read(files[0], text) == ([0, 1, 2], close([0, 0.1, 0.3]))
    text = r"read without the times of .*leaf\.pvd, which lists 3 of the 4 files"
    for path in (files[3], tmp_path / "leaf_#.vtu"):
        assert read(path, text) == ([0, 1, 2, 3], close([0, 1 / 30, 2 / 30, 3 / 30]))


@pytest.mark.formats
def test_indices_that_disagree_are_named(tmp_path):
    names = [f"leaf_{place}.vtu" for place in range(3)]
    files = write_all(tmp_path, names)
    pvd(tmp_path / "a.pvd", names, [0, 0.1, 0.3])
    series(tmp_path / "b.vtu.series", names, [0, 0.1, 0.3])
    assert read(files[0]) == ([0, 1, 2], close([0, 0.1, 0.3]))
    index = pvd(tmp_path / "c.pvd", names, [0, 1, 3])
    assert read(files[0], r"read by .*a\.pvd; .*c\.pvd has other files or times: name the one that is meant") == (
        [0, 1, 2],
        close([0, 0.1, 0.3]),
    )
    assert read(index) == ([0, 1, 2], close([0, 1, 3]))


@pytest.mark.formats
def test_an_index_and_files_that_state_other_times_are_said(tmp_path):
    names = [f"leaf_{place}.vtu" for place in range(3)]
    write_all(tmp_path, names, field=list(map(xml_field, [0, 0.2, 0.4])))
    assert read(pvd(tmp_path / "same.pvd", names, [0, 0.2, 0.4])) == ([0, 1, 2], close([0, 0.2, 0.4]))
    index = pvd(tmp_path / "other.pvd", names, [0, 0.1, 0.2])
    text = r"other\.pvd: the index has 0\.1 for leaf_1\.vtu, and is taken; the file has 0\.2 in the field TimeValue"
    assert read(index, text) == ([0, 1, 2], close([0, 0.1, 0.2]))


@pytest.mark.formats
def test_a_broken_index_beside_the_files_is_said(tmp_path):
    files = write_all(tmp_path, ["leaf_0.vtu", "leaf_1.vtu"])
    (tmp_path / "leaf.vtu.series").write_text('{"files": [{"name": "leaf_0.vtu"}]}')
    text = (
        r"read without its index: .*leaf\.vtu\.series: files\[0\]: got .*expected \{.name.: .FILE., .time.: SECONDS\}"
    )
    assert read(files[0], text) == ([0, 1], close([0, 1 / 30]))


REFUSED = {
    "no JSON": ("a.vtu.series", "{", "got no JSON"),
    "deep JSON": ("a.vtu.series", "[" * 100_000, "recursion"),
    "no files": ("a.vtu.series", '{"files": {}}', 'got no "files"'),
    "no time": ("a.vtu.series", '{"files": [{"name": "a_0.vtu", "time": "soon"}]}', "got the time 'soon' of 'a_0.vtu'"),
    "endless time": ("a.vtu.series", '{"files": [{"name": "a_0.vtu", "time": NaN}]}', "got the time 'nan'"),
    "no name": ("a.vtu.series", '{"files": [{"name": "", "time": 0}]}', "got the file name ''"),
    "outside": ("a.vtu.series", '{"files": [{"name": "../a_0.vtu", "time": 0}]}', "--allow-outside"),
    "no timestep": ("a.pvd", '<VTKFile><DataSet file="a"/><DataSet file="b"/></VTKFile>', "got no timestep for 'a'"),
    "an uneven part": (
        "a.pvd",
        '<VTKFile><DataSet file="a" timestep="0"/><DataSet file="b" timestep="1" part="0"/>'
        '<DataSet file="c" timestep="1" part="1"/></VTKFile>',
        "got 2 files at the time 1, expected the 1 parts",
    ),
    "no suffix of files": (
        "a.series",
        '{"files": []}',
        "got an unknown format.*; an index has the suffix of its files, too: NAME.vtu.series",
    ),
}


@pytest.mark.formats
@pytest.mark.parametrize("name, text, message", REFUSED.values(), ids=REFUSED)
def test_a_broken_index_is_refused_and_named(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    write(tmp_path / "a_0.vtu", 0)
    with pytest.raises(ClipError, match=message) as caught:
        athcodec.read(tmp_path / name)
    assert str(tmp_path / name) in str(caught.value) and "\n" not in str(caught.value)


# ---- numbers in names ----

SECONDS = "have decimals and are taken for seconds"
FRAMES = "do not follow one another and are taken for frames"
DECIMALS = {
    "no padding": (["a_0.1", "a_0.15", "a_0.2", "a_1.25"], [0.1, 0.15, 0.2, 1.25]),
    "padding": (["a_0.50", "a_0.75", "a_1.00", "a_1.25"], [0.5, 0.75, 1, 1.25]),
    "thousandths past a second": (["a_0.998", "a_0.999", "a_1.000", "a_1.001"], [0.998, 0.999, 1, 1.001]),
    "one digit": (["a_0.1", "a_0.2", "a_0.3"], [0.1, 0.2, 0.3]),
    "whole numbers among them": (["a_0", "a_0.5", "a_1", "a_1.5"], [0, 0.5, 1, 1.5]),
    "exponents": (["a_1e-05", "a_0.0001", "a_0.0015", "a_1.5e-02"], [1e-5, 1e-4, 1.5e-3, 1.5e-2]),
    "below zero": (["a_-0.5", "a_-0.25", "a_0.0", "a_0.25"], [-0.5, -0.25, 0, 0.25]),
    "a hyphen": (["a-0.1", "a-0.15", "a-0.2"], [0.1, 0.15, 0.2]),
    "a comma": (["a_0,1", "a_0,15", "a_0,2"], [0.1, 0.15, 0.2]),
    "behind a word": (["a0.1", "a0.15", "a0.2"], [0.1, 0.15, 0.2]),
    "behind t": (["a_t1.0001", "a_t1.0002", "a_t2.0001"], [1.0001, 1.0002, 2.0001]),
    "in the middle": (["a_t0.05_mesh", "a_t0.1_mesh", "a_t0.25_mesh"], [0.05, 0.1, 0.25]),
    "behind time=": (["time=0.5_a", "time=0.75_a", "time=1_a"], [0.5, 0.75, 1]),
    "before a counter that stays": (["a_t0.1_0001", "a_t0.25_0001"], [0.1, 0.25]),
    "alone": (["0.1", "0.15", "0.2"], [0.1, 0.15, 0.2]),
}


@pytest.mark.formats
@pytest.mark.parametrize("names, times", DECIMALS.values(), ids=DECIMALS)
def test_decimals_are_read_wherever_they_stand(tmp_path, names, times):
    files = write_all(tmp_path, [f"{name}.obj" for name in names])
    (tmp_path / "other.obj").write_text("")
    expected = (list(range(len(names))), close([time - times[0] for time in times]))
    for path in files:
        assert read(path, SECONDS) == expected


WHOLE = {
    "a name and a frame": (["sim2.0001", "sim2.0002", "sim2.0003"], [1, 2, 3], []),
    "a name with 0 and a frame": (
        ["leaf0.001", "leaf0.002"],
        [1, 2],
        ["the digits behind the point in the names are taken for the frames 1, 2; if the numbers are decimals"],
    ),
    "a name of a number and a frame": (
        ["sim_2.0001", "sim_2.0002"],
        [1, 2],
        ["the digits behind the point in the names are taken for the frames 1, 2; if the numbers are decimals"],
    ),
    "counted past nine": (["a_2.8", "a_2.9", "a_2.10", "a_2.11"], [8, 9, 10, 11], []),
    "a point": (["a.8", "a.9", "a.10"], [8, 9, 10], []),
    "strides": (["a_0", "a_40", "a_80"], [0, 40, 80], [FRAMES]),
    "gaps": (["a_01", "a_02", "a_04"], [1, 2, 4], [FRAMES]),
    "behind t in the middle": (["a_t1_mesh", "a_t2_mesh", "a_t10_mesh"], [1, 2, 10], [FRAMES]),
    "one after the other": (["a_9", "a_10", "a_11"], [9, 10, 11], []),
}


@pytest.mark.formats
@pytest.mark.parametrize("names, numbers, texts", WHOLE.values(), ids=WHOLE)
def test_whole_numbers_are_frames(tmp_path, names, numbers, texts):
    files = write_all(tmp_path, [f"{name}.obj" for name in names])
    expected = (list(range(len(names))), close([(number - numbers[0]) / 30 for number in numbers]))
    for path in files:
        assert read(path, *texts) == expected


@pytest.mark.formats
@pytest.mark.parametrize(
    "names, pattern",
    [
        (["frame0009_leaf", "frame0010_leaf", "frame0011_leaf"], "frame####_leaf"),
        (["frame9_leaf", "frame10_leaf", "frame11_leaf"], "frame#_leaf"),
        (["0.05_leaf", "0.1_leaf", "0.25_leaf"], "#_leaf"),
    ],
)
def test_numbers_in_the_middle_are_named_with_a_pattern_that_reads_them(tmp_path, names, pattern):
    files = write_all(tmp_path, [f"{name}.obj" for name in names])
    text = (
        rf"read as one frame, without {names[1]}\.obj, {names[2]}\.obj, which differ in a number that is not the last"
    )
    if names[1] == "frame10_leaf":
        text = r"read as one frame, without frame10_leaf\.obj, frame11_leaf\.obj, which differ in a number"
    with pytest.warns(GuessWarning, match=text) as said, athcodec.read(files[0]) as clip:
        assert clip.frame_count == 1
    advised = re.search(r"(\S+) names all of them as one motion", str(said[0].message))[1]
    assert advised == str(tmp_path / f"{pattern}.obj")
    assert read(advised, *([SECONDS] if "." in names[0] else []))[0] == [0, 1, 2]


@pytest.mark.formats
def test_names_of_one_number_twice_are_refused(tmp_path):
    files = write_all(tmp_path, ["a_0.1.obj", "a_0.10.obj", "a_1e-1.obj", "a_0.25.obj"])
    with pytest.raises(
        ClipError, match=r"a_0\.10\.obj: has the number of a_0\.1\.obj, 0\.1, expected one file for each"
    ):
        athcodec.read(files[3])


@pytest.mark.formats
def test_a_file_that_is_a_piece_of_a_frame_is_said(tmp_path):
    write_all(tmp_path, ["leaf_0_0.vtu", "leaf_0_1.vtu"])
    (tmp_path / "leaf_0.pvtu").write_text(
        '<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid><Piece Source="leaf_0_0.vtu"/><Piece '
        'Source="leaf_0_1.vtu"/></PUnstructuredGrid></VTKFile>'
    )
    text = r"read as one of 2 frames, though .*leaf_0\.pvtu lists it as a piece of one; name .*leaf_0\.pvtu"
    assert read(tmp_path / "leaf_0_0.vtu", text)[0] == [0, 1]
    with athcodec.read(tmp_path / "leaf_0.pvtu") as clip:
        assert clip.frame_count == 1 and clip.block(0, 1)[0, [0, 3], 2].tolist() == [0, 1]


@pytest.mark.formats
def test_the_shell_may_name_all_files_of_a_sequence_with_decimals(tmp_path):
    from athcodec.sources.numbering import each_once

    files = [str(file) for file in write_all(tmp_path, ["leaf_0.1.obj", "leaf_0.15.obj", "leaf_0.2.obj"])]
    assert each_once(files) == [(files[0], "leaf")]
    with pytest.raises(ClipError, match="got 2 names of a sequence of 3 files"):
        each_once(files[:2])
