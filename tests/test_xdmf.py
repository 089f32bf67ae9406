"""XDMF as other programs write it: where the mesh, the displacement and the times are stated, and what is named.

The text is written here, as DOLFINx, meshio and solvers with XDMF 2 and 3 write it; the values are closed forms."""

from __future__ import annotations

import bz2
import zlib

import h5py
import numpy as np
import pytest

import athcodec
from athcodec.errors import ClipError, GuessWarning, SourceWarning

HEIGHT = np.linspace(0.0, 2.0, 9)
REST = np.concatenate([np.stack([x + 0 * HEIGHT, HEIGHT, 0 * HEIGHT], axis=1) for x in (0.0, 0.2)])
QUADS = np.array([[i, i + 9, i + 10, i + 1] for i in range(8)])
TIMES = np.array([0.0, 0.1, 0.25, 0.3, 0.5, 0.9])
BENT = 0.1 * np.sin(3 * TIMES)[:, None] * REST[:, 1] ** 2
MOVED = np.stack([BENT, 0 * BENT, 0 * BENT], axis=2)  # (6, 18, 3), the displacement.
MOTION = REST + MOVED
STEM = '/Xdmf/Domain/Grid[@Name="stem"]/*[self::Topology or self::Geometry]'


def text(values) -> str:
    return " ".join(map(repr, np.asarray(values).reshape(-1).tolist()))


def item(values, **more) -> str:
    """A DataItem with its numbers in place."""
    values = np.asarray(values)
    kind = "Int" if values.dtype.kind == "i" else "Float"
    said = {"Dimensions": " ".join(map(str, values.shape)), "NumberType": kind, "Precision": 8, "Format": "XML"} | more
    words = " ".join(f'{key}="{value}"' for key, value in said.items())
    return f"<DataItem {words}>{text(values)}</DataItem>"


def topology(quads=QUADS, more="") -> str:
    return f'<Topology TopologyType="Quadrilateral" {more}>{item(quads)}</Topology>'


def geometry(points=REST) -> str:
    return f'<Geometry GeometryType="XYZ">{item(points)}</Geometry>'


def mesh(name, points=REST) -> str:
    return grid(name, topology() + geometry(points))


def grid(name, content, kind='GridType="Uniform"') -> str:
    return f'<Grid Name="{name}" {kind}>{content}</Grid>'


def temporal(name, steps) -> str:
    return grid(name, "".join(steps), 'GridType="Collection" CollectionType="Temporal"')


def spatial(name, grids, more="") -> str:
    return grid(name, more + "".join(grids), 'GridType="Collection" CollectionType="Spatial"')


def attribute(values, name="displacement", center="Node") -> str:
    return f'<Attribute Name="{name}" AttributeType="Vector" Center="{center}">{values}</Attribute>'


def include(pointer=STEM, more="") -> str:
    return f"<xi:include {more} xpointer='xpointer({pointer})'/>"


def time(value) -> str:
    return f'<Time Value="{value}"/>'


def write(folder, *grids, name="a.xdmf", space='xmlns:xi="http://www.w3.org/2001/XInclude"'):
    path = folder / name
    path.write_text(f'<?xml version="1.0"?><Xdmf Version="3.0" {space}><Domain>{"".join(grids)}</Domain></Xdmf>')
    return path


def series(of_mesh=None, name="displacement", moved=MOVED, field="displacement", times=TIMES) -> str:
    """A temporal collection as DOLFINx writes it: the mesh in each step, or an include of it."""
    content = topology() + geometry() if of_mesh is None else of_mesh
    steps = [content + time(float(t)) + attribute(item(each), field) for t, each in zip(times, moved)]
    return temporal(name, [grid(name, step) for step in steps])


def assert_motion(clip, motion=MOTION, times=TIMES):
    assert np.allclose(clip.block(0, clip.frame_count), motion, rtol=0, atol=1e-12)
    assert np.allclose(clip.time, times - times[0], rtol=0, atol=1e-12)


# ---- meshes ----


def test_a_step_has_the_mesh_that_it_includes_and_others_are_named(tmp_path):
    path = write(tmp_path, mesh("leaf", REST + 5), mesh("stem"), series(include()))
    with pytest.warns(SourceWarning, match="not read: mesh leaf"), athcodec.read(path) as clip:
        assert_motion(clip)
        assert np.array_equal(clip.faces, QUADS) and clip.not_read == {"mesh": ["leaf"]}


POINTERS = {
    "by place": "//Grid[2]/*[self::Topology or self::Geometry]",
    "by two paths": '//Grid[@Name="stem"]/Topology | //Grid[@Name="stem"]/Geometry',
    "by names": '//Grid[@Name="stem"]/*[name()="Topology" or local-name()="Geometry"]',
    "by both": '/Xdmf/Domain/Grid[@Name="stem" and @GridType="Uniform"]/node()',
    "by the last": '/Xdmf/Domain/Grid[not(@GridType="Collection")][last()]/*',
    "by a part of the name": '//Grid[contains(@Name, "te") and starts-with(@Name, "st")]/child::*',
    "by what is in it": "(//Geometry/parent::Grid)[position()=2]/*",
}


@pytest.mark.formats
@pytest.mark.parametrize("pointer", POINTERS.values(), ids=POINTERS)
def test_pointers_of_every_form_lead_to_the_mesh(tmp_path, pointer):
    path = write(tmp_path, mesh("leaf", REST + 5), mesh("stem"), series(include(pointer)))
    with pytest.warns(SourceWarning, match="mesh leaf"), athcodec.read(path) as clip:
        assert_motion(clip)


INCLUDES = {
    "by numbers": "<xi:include xpointer='element(/1/1/2/1)'/><xi:include xpointer='element(/1/1/2/2)'/>",
    "the first part that finds any": include().replace("xpointer='", "xpointer='xmlns(a=b)xpointer(//Nothing)"),
    "by a fallback": f"<xi:include xpointer='xpointer(//Nothing)'><xi:fallback>{include()}</xi:fallback></xi:include>",
    "of one that includes": include('/Xdmf/Domain/Grid[@Name="again"]/*'),
    "references": '<Topology Reference="XML">/Xdmf/Domain/Grid[@Name="stem"]/Topology</Topology>'
    '<Geometry Reference="/Xdmf/Domain/Grid[2]/Geometry"/>',
}


@pytest.mark.formats
@pytest.mark.parametrize("content", INCLUDES.values(), ids=INCLUDES)
def test_includes_and_references_of_every_form_are_followed(tmp_path, content):
    again = grid("again", include())
    path = write(tmp_path, mesh("leaf", REST + 5), mesh("stem"), again, series(content))
    with pytest.warns(SourceWarning, match="mesh leaf"), athcodec.read(path) as clip:
        assert_motion(clip)


@pytest.mark.formats
def test_a_mesh_in_another_file_is_read_from_the_folder_of_the_source(tmp_path):
    (tmp_path / "mesh").mkdir()
    with h5py.File(tmp_path / "mesh" / "points.h5", "w") as file:
        file["points"] = REST
    points = '<DataItem Dimensions="18 3" Format="HDF">points.h5:/points</DataItem>'
    write(tmp_path / "mesh", grid("stem", topology() + f'<Geometry GeometryType="XYZ">{points}</Geometry>'))
    path = write(tmp_path, series(include(more='href="mesh/a.xdmf"')))
    with athcodec.read(path) as clip:
        assert_motion(clip)
        (tmp_path / "mesh" / "a.xdmf").touch()
        assert not clip.unchanged()
    (tmp_path / "inside").mkdir()
    outside = write(tmp_path / "inside", series(include(more='href="../mesh/a.xdmf"')))
    with pytest.raises(ClipError, match="allow-outside"):
        athcodec.read(outside)
    with athcodec.read(outside, allow_outside=True) as clip:
        assert_motion(clip)
    whole = write(tmp_path, "<xi:include href='mesh/a.xdmf' xpointer='xpointer(//Grid)'/>", series(include()))
    with pytest.raises(ClipError, match="names nothing in the file"):  # A pointer finds what stands there itself.
        athcodec.read(whole)


BROKEN = {
    "a pointer to nothing": (include("//Nothing"), "xi:include: 'xpointer.*names nothing in the file"),
    "a file that is missing": (include(more='href="b.xdmf"'), "'b.xdmf', which does not exist"),
    "an unknown path": (include("//Grid[sum(1)]"), r"expected a path that is known at 'sum\(\)'"),
    "an unknown scheme": ("<xi:include xpointer='svgView(1)'/>", "got the scheme 'svgView'"),
    "includes in a circle": (include("//include"), "lead to each other"),
    "references in a circle": (
        '<Geometry Reference="//Grid[last()]/Grid/Geometry"/>',
        "Geometry: got a reference|lead",
    ),
    "a reference to another kind": ('<Geometry Reference="//Topology"/>', "Geometry: got a reference to"),
}


@pytest.mark.formats
@pytest.mark.parametrize("content, message", BROKEN.values(), ids=BROKEN)
def test_includes_that_lead_nowhere_are_refused_by_name(tmp_path, content, message):
    path = write(tmp_path, mesh("stem"), series(content, times=TIMES[:1]))
    with pytest.raises(ClipError, match=message):
        athcodec.read(path)


@pytest.mark.formats
def test_many_includes_of_includes_end(tmp_path):
    grids = [spatial(f"g{n}", 12 * [include(f'/Xdmf/Domain/Grid[@Name="g{n + 1}"]')]) for n in range(9)]
    with pytest.raises(ClipError, match="expected fewer"):
        athcodec.read(write(tmp_path, *grids, mesh("g9")))


@pytest.mark.formats
def test_steps_without_a_mesh_take_the_only_one_and_say_so(tmp_path):
    with pytest.warns(GuessWarning, match="'displacement' have no mesh, and that of 'stem' was taken"):
        with athcodec.read(write(tmp_path, mesh("stem"), series(""))) as clip:
            assert_motion(clip)
            assert clip.not_read == {}
    with pytest.raises(ClipError, match="expected one, .* of the meshes in the file: 'leaf', 'stem'"):
        athcodec.read(write(tmp_path, mesh("leaf"), mesh("stem"), series("")))


# ---- several series ----


def test_the_displacement_is_found_in_whatever_series_it_is(tmp_path):
    velocity = series(include(), "velocity", 7 * MOVED, "velocity")
    path = write(tmp_path, mesh("stem"), velocity, series(include()))
    with athcodec.read(path) as clip:
        assert_motion(clip)
        assert clip.not_read == {"field": ["velocity"]}
    with athcodec.read(path, field="velocity") as clip:
        assert_motion(clip, REST + 7 * MOVED)


@pytest.mark.formats
def test_series_at_other_times_are_named_or_asked_about(tmp_path):
    pressure = series(include(), "pressure", MOVED[:3], "pressure", 2 * TIMES[:3])
    with athcodec.read(write(tmp_path, mesh("stem"), pressure, series(include()))) as clip:
        assert_motion(clip)
        assert clip.not_read == {"field": ["pressure/pressure"]}
    slow = series(include(), "slow", MOVED, "displacement", 2 * TIMES)
    path = write(tmp_path, mesh("stem"), slow, series(include()))
    with pytest.raises(ClipError, match="'slow' with displacement; 'displacement' with displacement; .*--only"):
        athcodec.read(path)
    with athcodec.read(path, only=["slow"]) as clip:
        assert_motion(clip, MOTION, 2 * TIMES)
    with pytest.raises(ClipError, match="only: got no grid of these names, expected some of 'stem', 'slow'"):
        athcodec.read(path, only=["fast"])
    with pytest.raises(ClipError, match="field: got 'v', expected one of 'slow' with displacement"):
        athcodec.read(path, field="v")


@pytest.mark.formats
def test_two_functions_of_one_name_keep_the_names_of_their_series(tmp_path):
    path = write(tmp_path, mesh("stem"), series(include(), "v", 7 * MOVED, "f"), series(include(), "u", MOVED, "f"))
    with pytest.raises(ClipError, match="only f, u/f; name one of them with --field"):
        athcodec.read(path)
    with athcodec.read(path, field="u/f") as clip:
        assert_motion(clip)


@pytest.mark.formats
def test_a_mesh_that_each_series_has_for_itself_is_one_mesh(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:  # As DOLFIN writes two functions into one file.
        for number in range(2):
            file[f"Mesh/{number}/geometry"], file[f"Mesh/{number}/topology"] = REST, QUADS
    own = [
        '<Topology TopologyType="Quadrilateral"><DataItem Dimensions="8 4" NumberType="Int" Precision="8" Format="HDF">'
        f'a.h5:/Mesh/{n}/topology</DataItem></Topology><Geometry GeometryType="XYZ"><DataItem Dimensions="18 3" '
        f'Format="HDF">a.h5:/Mesh/{n}/geometry</DataItem></Geometry>'
        for n in range(2)
    ]
    with athcodec.read(write(tmp_path, series(own[0], "v", 7 * MOVED, "velocity"), series(own[1]))) as clip:
        assert_motion(clip)
        assert clip.not_read == {"field": ["velocity"]}
    alike = [grid(str(n), topology() + geometry() + attribute(item(MOVED[1]))) for n in range(2)]
    with athcodec.read(write(tmp_path, temporal("plant", [spatial("0", alike, time(0))]))) as clip:
        assert clip.vertex_count == 36  # Two of one shape in a step are two.


@pytest.mark.formats
def test_steps_that_include_the_grid_of_their_mesh_have_it(tmp_path):
    path = write(tmp_path, mesh("leaf", REST + 5), mesh("stem"), series(include('/Xdmf/Domain/Grid[@Name="stem"]')))
    with pytest.warns(SourceWarning, match="mesh leaf"), athcodec.read(path) as clip:
        assert_motion(clip)


@pytest.mark.formats
def test_tags_of_the_mesh_that_dolfinx_writes_beside_it_are_named(tmp_path):
    tags = topology(QUADS[:2]) + include('//Grid[@Name="stem"]/Geometry')
    tags = grid("facet_tags", tags + attribute(item(np.arange(2)), "facet_tags", "Cell"))
    with athcodec.read(write(tmp_path, mesh("stem"), tags, series(include()))) as clip:
        assert_motion(clip)
        assert clip.not_read == {"field": ["facet_tags/facet_tags"]}


# ---- several meshes in a step ----


def pieces(step, *, moved=True):
    own = [("leaf", REST + 5), ("stem", REST)]
    return [
        grid(name, topology() + geometry(points) + (attribute(item(MOVED[step])) if moved else ""))
        for name, points in own
    ]


@pytest.mark.formats
@pytest.mark.parametrize("inside", ["temporal", "spatial", "tree"])
def test_meshes_that_move_together_are_objects_of_one_clip(tmp_path, inside):
    steps = range(len(TIMES))
    if inside == "spatial":
        parts = [
            temporal(name, [pieces(t)[n].replace("<Topology", time(TIMES[t]) + "<Topology") for t in steps])
            for n, name in enumerate(("leaf", "stem"))
        ]
        content = spatial("plant", parts)
    else:
        made = [spatial(f"step {t}", pieces(t), time(TIMES[t])) for t in steps]
        made = [
            each.replace('"Collection" CollectionType="Spatial"', '"Tree"') if inside == "tree" else each
            for each in made
        ]
        content = temporal("plant", made)
    with athcodec.read(write(tmp_path, content)) as clip:
        assert_motion(clip, np.concatenate([MOTION + 5, MOTION], axis=1))
        assert np.array_equal(clip.faces, np.concatenate([QUADS, QUADS + 18]))
        assert clip.metadata["part_names"] == ["leaf", "stem"]
        assert clip.attributes["part_vertex_counts"].tolist() == [18, 18]


@pytest.mark.formats
def test_series_of_two_meshes_at_the_same_times_are_one_clip_and_what_has_no_displacement_stays(tmp_path):
    leaf = include('//Grid[@Name="leaf"]/*')
    path = write(tmp_path, mesh("leaf", REST + 5), mesh("stem"), series(leaf, "l", 2 * MOVED), series(include(), "s"))
    with athcodec.read(path) as clip:
        assert_motion(clip, np.concatenate([REST + 5 + 2 * MOVED, MOTION], axis=1))
        assert clip.metadata["part_names"] == ["l", "s"]
    made = [spatial(f"{t}", pieces(t), time(TIMES[t])) for t in range(6)]
    path = write(tmp_path, temporal("plant", [each.replace("displacement", "stress", 1) for each in made]))
    with (
        pytest.warns(GuessWarning, match="leaf has no displacement, and stays where it is"),
        athcodec.read(path) as clip,
    ):
        assert_motion(clip, np.concatenate([np.repeat(REST[None] + 5, 6, axis=0), MOTION], axis=1))


@pytest.mark.formats
def test_a_step_with_another_number_of_meshes_is_refused(tmp_path):
    steps = [spatial("0", pieces(0), time(0)), spatial("1", pieces(1)[:1], time(1))]
    with pytest.raises(ClipError, match="step 1: got 1 grids, expected 2"):
        athcodec.read(write(tmp_path, temporal("plant", steps)))


@pytest.mark.formats
def test_meshes_without_a_series_are_one_frame(tmp_path):
    with athcodec.read(write(tmp_path, mesh("leaf", REST + 5), mesh("stem"))) as clip:
        assert clip.frame_count == 1 and clip.metadata["part_names"] == ["leaf", "stem"]
        assert np.array_equal(clip.block(0, 1)[0], np.concatenate([REST + 5, REST]))
    apart = [mesh(str(n)).replace("<Topology", time(n) + "<Topology") for n in range(2)]
    with pytest.raises(ClipError, match="got 2 grids at different times and no temporal collection"):
        athcodec.read(write(tmp_path, *apart))


# ---- times ----

COMMON = {
    "list": (f'<Time TimeType="List">{item(TIMES)}</Time>', TIMES),
    "hyperslab": (f'<Time TimeType="HyperSlab">{item(np.array([1.0, 0.25, 6.0]))}</Time>', 0.25 * np.arange(6)),
    "range": (f'<Time TimeType="Range">{item(np.array([1.0, 2.0]))}</Time>', 0.2 * np.arange(6)),
    "values": (f'<Time Value="{text(TIMES)}"/>', TIMES),
}


@pytest.mark.formats
@pytest.mark.parametrize("common, times", COMMON.values(), ids=COMMON)
def test_times_of_a_collection_are_read(tmp_path, common, times):
    steps = [grid("s", include() + attribute(item(moved))) for moved in MOVED]
    path = write(tmp_path, mesh("stem"), temporal("u", [common, *steps]))
    with athcodec.read(path) as clip:
        assert_motion(clip, MOTION, times)


@pytest.mark.formats
def test_times_of_steps_may_be_items_and_in_any_order(tmp_path):
    order = [3, 0, 5, 1, 4, 2]
    steps = [
        grid("s", include() + f'<Time TimeType="Single">{item(TIMES[t : t + 1])}</Time>' + attribute(item(MOVED[t])))
        for t in order
    ]
    with athcodec.read(write(tmp_path, mesh("stem"), temporal("u", steps))) as clip:
        assert_motion(clip)


@pytest.mark.formats
@pytest.mark.parametrize(
    "stated",
    [
        '<Information Name="Time" Value="{}"/>',
        '<Attribute Name="TIME" Center="Grid"><DataItem Dimensions="1">{}</DataItem></Attribute>',
    ],
)
def test_times_that_are_stated_elsewhere_are_taken_and_said(tmp_path, stated):
    steps = [grid("s", include() + stated.format(t) + attribute(item(moved))) for t, moved in zip(TIMES, MOVED)]
    path = write(tmp_path, mesh("stem"), temporal("u", steps))
    with pytest.warns(GuessWarning, match="Time: (Information Time|Attribute TIME) was taken"):
        with athcodec.read(path) as clip:
            assert np.allclose(clip.block(0, 6), MOTION, rtol=0, atol=1e-12)
            assert np.allclose(clip.time, TIMES, rtol=0, atol=1e-6)


@pytest.mark.formats
def test_a_file_of_one_frame_among_others_says_so(tmp_path):
    for number in range(3):
        write(tmp_path, mesh("stem"), name=f"plant_{number}.xdmf")
    with pytest.warns(GuessWarning, match=r"read as one frame, without plant_0\.xdmf"):
        athcodec.read(tmp_path / "plant_1.xdmf").close()
    np.save(tmp_path / "plant_1.npy", REST)
    np.save(tmp_path / "plant_2.npy", REST)
    with pytest.warns(GuessWarning, match=r"read as one frame, without plant_2\.npy"):
        athcodec.read(tmp_path / "plant_1.npy", axes="vertices,xyz").close()


@pytest.mark.formats
def test_missing_times_are_said_or_refused(tmp_path):
    steps = [grid(f"s{n}", include() + attribute(item(moved))) for n, moved in enumerate(MOVED)]
    path = write(tmp_path, mesh("stem"), temporal("u", steps))
    with pytest.warns(GuessWarning, match="the steps have none, and come 30 a second; --fps"):
        with athcodec.read(path) as clip:
            assert_motion(clip, MOTION, np.arange(6) / 30)
    with athcodec.read(path, fps=25) as clip:
        assert_motion(clip, MOTION, np.arange(6) / 25)
    steps[0] = steps[0].replace("<Attribute", time(0.5) + "<Attribute")
    path = write(tmp_path, mesh("stem"), temporal("u", steps))
    with pytest.raises(ClipError, match=r"got none in step 1 \('s1'\) and one in others.*--fps"):
        athcodec.read(path)
    with athcodec.read(path, fps=25) as clip:
        assert_motion(clip, MOTION, np.arange(6) / 25)
    wrong = f'<Time TimeType="HyperSlab">{item(np.array([0.0, 1.0, 7.0]))}</Time>'
    with pytest.raises(ClipError, match="got 7 times, expected 6"):
        athcodec.read(write(tmp_path, mesh("stem"), temporal("u", [wrong, *steps[1:], steps[1]])))


# ---- numbers ----


def raw(folder, values, dtype, packing=None):
    data = np.asarray(values).astype(dtype).tobytes()
    packed = {"Zlib": zlib.compress, "BZip2": bz2.compress}[packing](data) if packing else data
    (folder / "a.bin").write_bytes(b"front" + packed)
    said = f'Compression="{packing}"' if packing else ""
    precision, endian = np.dtype(dtype).itemsize, "Big" if dtype[0] == ">" else "Little"
    return (
        f'<DataItem Dimensions="18 3" NumberType="Float" Precision="{precision}" Format="Binary" Endian="{endian}" '
        f'Seek="5" {said}>a.bin</DataItem>'
    )


def hdf(folder, values, place="/values", said="18 3"):
    with h5py.File(folder / "a.h5", "w") as file:
        file["values"] = values
    return f'<DataItem Dimensions="{said}" NumberType="Float" Precision="8" Format="HDF">a.h5:{place}</DataItem>'


x, y, z = (item(MOVED[1][:, axis]) for axis in range(3))
PADDED = np.pad(MOVED[1], ((2, 1), (0, 2)))
ITEMS = {
    "text": lambda folder: item(MOVED[1]),
    "raw, big endian": lambda folder: raw(folder, MOVED[1], ">f8"),
    "raw, little endian": lambda folder: raw(folder, MOVED[1], "<f8"),
    "raw, zlib": lambda folder: raw(folder, MOVED[1], ">f8", "Zlib"),
    "raw, bzip2": lambda folder: raw(folder, MOVED[1], "<f8", "BZip2"),
    "hdf": lambda folder: hdf(folder, MOVED[1]),
    "hdf, flat": lambda folder: hdf(folder, MOVED[1].reshape(-1)),
    "hdf, a part": lambda folder: hdf(folder, PADDED, "/values|2 0:1 1:18 3:21 5"),
    "hyperslab": lambda folder: (
        f'<DataItem ItemType="HyperSlab" Dimensions="18 3">{item(np.array([[2, 0], [1, 1], [18, 3]]))}'
        f"{item(PADDED)}</DataItem>"
    ),
    "interlaced": lambda folder: (
        f'<DataItem ItemType="Function" Function="JOIN($0, $1, $2)" Dimensions="18 3">{x}{y}{z}</DataItem>'
    ),
    "joined": lambda folder: (
        '<DataItem ItemType="Function" Function="JOIN($0 ; $1)" Dimensions="18 3">'
        f"{item(MOVED[1][:7])}{item(MOVED[1][7:])}</DataItem>"
    ),
    "computed": lambda folder: (
        '<DataItem ItemType="Function" Function="ABS(-(($0 + 1.5) * $1 - $1) / 0.5) - 0" Dimensions="18 3">'
        f"{item(0 * MOVED[1])}{item(MOVED[1])}</DataItem>"
    ),
    "a reference": lambda folder: '<DataItem Reference="//DataItem[@Name=&quot;moved&quot;]"/>',
}


@pytest.mark.formats
@pytest.mark.parametrize("make", ITEMS.values(), ids=ITEMS)
def test_numbers_are_read_wherever_they_lie(tmp_path, make):
    shared = item(MOVED[1], Name="moved")
    steps = [
        grid("s", include() + time(t) + attribute(values)) for t, values in enumerate((item(MOVED[0]), make(tmp_path)))
    ]
    with athcodec.read(write(tmp_path, shared, mesh("stem"), temporal("u", steps))) as clip:
        assert_motion(clip, MOTION[:2], np.arange(2.0))


REFUSED = {
    "a file of pictures": (item(MOVED[1], Format="TIFF"), "got the format 'TIFF', expected HDF, Binary or XML"),
    "coordinates": ('<DataItem ItemType="Coordinates"/>', "got the type 'Coordinates'"),
    "text": (item(MOVED[1], NumberType="String"), "got numbers of 'string'"),
    "a function that is unknown": (
        f'<DataItem ItemType="Function" Function="WHERE($0 > 1)" Dimensions="18 3">{item(MOVED[1])}</DataItem>',
        r"Function: got 'WHERE\(\$0 > 1\)' of 1 DataItems, expected",
    ),
    "code": (
        f'<DataItem ItemType="Function" Function="__import__(1)" Dimensions="18 3">{item(MOVED[1])}</DataItem>',
        "Function: got '__import__",
    ),
    "another shape": (item(MOVED[1], Dimensions="17 3"), r"got 54 numbers, expected \(17, 3\)"),
}


@pytest.mark.formats
@pytest.mark.parametrize("values, message", REFUSED.values(), ids=REFUSED)
def test_numbers_that_are_not_read_are_refused_by_name(tmp_path, values, message):
    step = grid("s", include() + time(0) + attribute(values))
    with pytest.raises(ClipError, match=message):
        athcodec.read(write(tmp_path, mesh("stem"), temporal("u", [step])), field="displacement").block(0, 1)


def test_numbers_in_hdf5_of_another_size_than_stated_are_refused(tmp_path):
    step = grid("s", include() + time(0) + attribute(hdf(tmp_path, MOVED[1], said="36 3")))
    with pytest.raises(ClipError, match=r"got 54 numbers, expected \(36, 3\)"):
        athcodec.read(write(tmp_path, mesh("stem"), temporal("u", [step])))


# ---- cells ----


@pytest.mark.formats
def test_numbers_of_nodes_may_begin_at_one_and_be_in_another_order(tmp_path):
    turned = topology(QUADS[:, [3, 2, 1, 0]] + 1, 'BaseOffset="1" Order="3 2 1 0"')
    with athcodec.read(write(tmp_path, grid("stem", turned + geometry()))) as clip:
        assert np.array_equal(clip.faces, QUADS)


@pytest.mark.formats
def test_curvilinear_grids_have_cells_between_their_points(tmp_path):
    flat = f'<Topology TopologyType="2DSMesh" Dimensions="2 9"/>{geometry()}'
    with athcodec.read(write(tmp_path, grid("leaf", flat))) as clip:
        assert {frozenset(face) for face in clip.faces.tolist()} == {frozenset(face) for face in QUADS.tolist()}
        normals = np.cross(
            REST[clip.faces[:, 1]] - REST[clip.faces[:, 0]], REST[clip.faces[:, 2]] - REST[clip.faces[:, 0]]
        )
        assert (normals[:, 2] < 0).all()  # The last dimension, y, comes first, then x.
    solid = (
        np.stack(np.meshgrid(*map(np.arange, (2, 3, 4)), indexing="ij"), axis=-1).reshape(-1, 3)[:, ::-1].astype(float)
    )
    thick = f'<Topology TopologyType="3DSMesh" Dimensions="2 3 4"/>{geometry(solid)}'
    with athcodec.read(write(tmp_path, grid("block", thick))) as clip:
        assert len(clip.attributes["cells_hexahedron"]) == 6
        corners = solid[clip.attributes["cells_hexahedron"]]
        edges = corners[:, [1, 3, 4]] - corners[:, [0]]
        assert np.allclose(np.linalg.det(edges), 1)
    regular = '<Topology TopologyType="3DCoRectMesh" Dimensions="2 3 4"/><Geometry GeometryType="ORIGIN_DXDYDZ"/>'
    with pytest.raises(ClipError, match="save grids without points of their own as unstructured ones"):
        athcodec.read(write(tmp_path, grid("block", regular)))


# ---- what is named ----


@pytest.mark.formats
def test_what_is_not_read_is_named(tmp_path):
    checkpoint = '<Attribute ItemType="FiniteElementFunction" ElementFamily="CG" Name="u" Center="Other"/>'
    content = include() + time(0) + attribute(item(MOVED[0])) + '<Set Name="tip"/><Information Name="load" Value="3"/>'
    content += checkpoint + attribute(item(MOVED[0]), "stress", "Edge")
    path = write(tmp_path, '<Information Name="author" Value="x"/>', mesh("stem"), temporal("u", [grid("s", content)]))
    with athcodec.read(path) as clip:
        assert clip.not_read["element"] == ["Information author", "Set tip", "Information load"]
        assert clip.not_read["field"] == ["u", "stress"]
    only = temporal("u", [grid("s", include() + time(t) + checkpoint) for t in range(2)])
    with pytest.raises(
        ClipError, match=r"u \(degrees of freedom of write_checkpoint; XDMFFile.write writes values per"
    ):
        athcodec.read(write(tmp_path, mesh("stem"), only))


@pytest.mark.formats
def test_a_namespace_of_the_file_and_several_domains_are_no_matter(tmp_path):
    domains = f"{mesh('stem')}</Domain><Domain>{series(include())}"
    space = 'xmlns="http://www.xdmf.org" xmlns:xi="http://www.w3.org/2003/XInclude"'
    with athcodec.read(write(tmp_path, domains, space=space)) as clip:
        assert_motion(clip)
