"""VTK's files, written here as text after the published descriptions of the formats: what is read, named, refused."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from moving_meshes import survives_damage

import athcodec
from athcodec.errors import ClipError, SourceWarning

# Seven points: two lines, a triangle, a quad and a strip of three triangles use them.
POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0], [1, 2, 0.5], [2, 2, 1]])
EDGES = [[0, 1], [2, 3], [3, 4]]
FACES = [[0, 1, 2], [0, 1, 3, 2], [0, 1, 2], [1, 3, 2], [2, 3, 4]]
CELLS = {
    "VERTICES": [[6]],
    "LINES": [[0, 1], [2, 3, 4]],
    "POLYGONS": [[0, 1, 2], [0, 1, 3, 2]],
    "TRIANGLE_STRIPS": [[0, 1, 2, 3, 4]],
}
HEAD = "# vtk DataFile Version {}\na root\n{}\nDATASET POLYDATA\n"


def text_of(values):
    return " ".join(map(str, np.asarray(values).reshape(-1).tolist())) + "\n"


def polydata(points, is_binary=False, has_offsets=False, more=b"", field=b""):
    """The bytes of a legacy file of the type POLYDATA: cells counted by themselves, or with offsets as of 5.0."""

    def array(values, kind):
        raw = np.asarray(values, {"i": ">i4", "l": ">i8", "d": ">f8"}[kind])
        return raw.tobytes() + b"\n" if is_binary else text_of(values).encode()

    head = HEAD.format("5.1" if has_offsets else "3.0", "BINARY" if is_binary else "ASCII").encode()
    parts = [head, field, f"POINTS {len(points)} double\n".encode(), array(points, "d")]
    for name, cells in CELLS.items():
        nodes = [node for cell in cells for node in cell]
        if has_offsets:
            offsets = np.cumsum([0, *map(len, cells)])
            parts += [f"{name} {len(offsets)} {len(nodes)}\nOFFSETS vtktypeint64\n".encode(), array(offsets, "l")]
            parts += [b"CONNECTIVITY vtktypeint64\n", array(nodes, "l")]
        else:
            counted = [number for cell in cells for number in (len(cell), *cell)]
            parts += [f"{name} {len(cells)} {len(counted)}\n".encode(), array(counted, "i")]
    return b"".join([*parts, more])


def polygons_of(clip):
    counts, corners = clip.polygons
    return [face.tolist() for face in np.split(corners, np.cumsum(counts)[:-1])]


@pytest.mark.parametrize("is_binary", [False, True])
@pytest.mark.parametrize("has_offsets", [False, True])
def test_legacy_polydata_is_read(tmp_path, is_binary, has_offsets):
    for frame in range(2):
        (tmp_path / f"root_{frame}.vtk").write_bytes(polydata(POINTS + frame, is_binary, has_offsets))
    with athcodec.read(tmp_path / "root_0.vtk") as clip:
        assert np.array_equal(clip.block(0, 2), [POINTS, POINTS + 1]) and clip.dtype == np.float64
        assert clip.edges.tolist() == EDGES and polygons_of(clip) == FACES
        assert clip.not_read == {}


# Attributes of every kind that a legacy file has, for seven points, as text; what of them is kept.
ATTRIBUTES = f"""CELL_DATA 6
SCALARS label int
LOOKUP_TABLE default
{text_of(range(6))}POINT_DATA 7
SCALARS radius double 1
LOOKUP_TABLE mine
{text_of(range(7))}LOOKUP_TABLE mine 2
0 0 0 1 1 1 1 1
COLOR_SCALARS shade 2
{text_of(np.arange(14) / 16)}VECTORS wind float
{text_of(range(21))}NORMALS normal float
{text_of(range(21))}TEXTURE_COORDINATES uv%20map 2 float
{text_of(range(14))}TENSORS stress double
{text_of(range(63))}GLOBAL_IDS id vtkIdType
{text_of(range(7))}FIELD FieldData 3
age 1 7 unsigned_char
{text_of(range(7))}METADATA
COMPONENT_NAMES
years
INFORMATION 1
NAME UNITS_LABEL LOCATION vtkDataArray
DATA a

names 1 7 string
a

c%20d
e
f
g
h

pair 2 7 short
{text_of(range(14))}"""


@pytest.mark.formats
def test_attributes_of_legacy_files_are_kept_by_their_names(tmp_path):
    (tmp_path / "root.vtk").write_bytes(polydata(POINTS, more=ATTRIBUTES.encode()))
    with athcodec.read(tmp_path / "root.vtk") as clip:
        widths = {
            "radius": 1,
            "shade": 2,
            "wind": 3,
            "normal": 3,
            "uv map": 2,
            "stress": 9,
            "id": 1,
            "age": 1,
            "pair": 2,
        }
        for name, width in widths.items():
            scale = 16 if name == "shade" else 1
            assert (clip.attributes[name] * scale).reshape(-1).tolist() == list(range(7 * width)), name
        assert clip.attributes["edge_label"].tolist() == [1, 2, 2]
        assert clip.attributes["face_label"].tolist() == [3, 4, 5, 5, 5]
        assert clip.not_read == {
            "field": ["names", "label"],  # The first cell is a vertex, which has no place.
            "other": ["tables of colours", "names of components", "UNITS_LABEL"],
        }


@pytest.mark.formats
def test_binary_strings_and_bits_are_passed_over(tmp_path):
    long = "ab" * 40
    strings = struct.pack(">B", 3 << 6 | 1) + b"a" + struct.pack(">H", 2 << 14 | len(long)) + long.encode()
    bits = np.packbits([1, 0, 1, 1, 0, 0, 1]).tobytes()
    more = b"POINT_DATA 7\nFIELD FieldData 3\nnames 2 1 string\n" + strings + b"\nis_leaf 1 7 bit\n" + bits
    more += b"\nage 1 7 double\n" + np.arange(7, dtype=">f8").tobytes() + b"\n"
    (tmp_path / "root.vtk").write_bytes(polydata(POINTS, True, more=more))
    with athcodec.read(tmp_path / "root.vtk") as clip:
        assert clip.attributes["age"].tolist() == list(range(7)) and clip.not_read == {"field": ["names"]}
        assert clip.attributes["is_leaf"].tolist() == [1, 0, 1, 1, 0, 0, 1]


@pytest.mark.formats
@pytest.mark.parametrize("is_binary", [False, True])
def test_damaged_legacy_polydata_is_refused_with_a_clip_error(tmp_path, is_binary):
    field = b"FIELD FieldData 1\nTIME 1 1 double\n" + (struct.pack(">d", 0.5) if is_binary else b"0.5") + b"\n"
    more = ATTRIBUTES.encode() if not is_binary else b"POINT_DATA 7\nVECTORS wind float\n" + bytes(84) + b"\n"
    for frame in range(2):
        (tmp_path / f"r{frame}.vtk").write_bytes(polydata(POINTS + frame, is_binary, is_binary, more, field))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("athcodec.sources.file_series.Series._warn", lambda self, text: None)
        patch.setattr("warnings.warn", lambda *args, **more: None)
        refused = survives_damage(tmp_path / "r1.vtk", lambda: athcodec.read(tmp_path / "r0.vtk"), cuts=40, changes=80)
    assert refused > 40


STRUCTURED = "# vtk DataFile Version 3.0\na leaf\nASCII\nDATASET STRUCTURED_GRID\nDIMENSIONS {}\nPOINTS {} float\n{}"


@pytest.mark.formats
def test_structured_grids_become_lines_quads_and_hexahedra(tmp_path):
    for size, expected in (
        ((3, 1, 1), [[0, 1], [1, 2]]),
        ((3, 1, 2), [[0, 1, 4, 3], [1, 2, 5, 4]]),
        ((1, 2, 3), [[0, 1, 3, 2], [2, 3, 5, 4]]),
        ((3, 2, 2), [[0, 1, 4, 3, 6, 7, 10, 9], [1, 2, 5, 4, 7, 8, 11, 10]]),
    ):
        count = int(np.prod(size))
        text = STRUCTURED.format(" ".join(map(str, size)), count, text_of(range(3 * count)))
        (tmp_path / "a.vtk").write_text(text)
        with athcodec.read(tmp_path / "a.vtk") as clip:
            found = [clip.edges, clip.faces, clip.attributes.get("cells_hexahedron")][sum(n > 1 for n in size) - 1]
            assert found.tolist() == expected and clip.block(0, 1)[0].reshape(-1).tolist() == list(range(3 * count))


REFUSED = {
    "another type": (HEAD.format("3.0", "ASCII").replace("POLYDATA", "FIELD"), "got a data set of the type 'FIELD'"),
    "another form": (HEAD.format("3.0", "PLAIN"), "got the form 'PLAIN', expected ASCII or BINARY"),
    "no points": (HEAD.format("3.0", "ASCII"), "got no POINTS"),
    "points to come": (HEAD.format("3.0", "ASCII") + "POINTS 1000000000000 float\n0 0 0\n", "end of the file"),
    "binary to come": (HEAD.format("3.0", "BINARY") + "POINTS 1000000000000 float\n0 0 0\n", "end of the file"),
    "an unknown type": (HEAD.format("3.0", "ASCII") + "POINTS 1 quad\n0 0 0\n", "numbers of the type 'quad'"),
    "no number": (HEAD.format("3.0", "ASCII") + "POINTS many float\n", "a number in place of 'many'"),
    "cells that do not fit": (
        HEAD.format("3.0", "ASCII") + "POINTS 1 float\n0 0 0\nLINES 1 3\n5 0 0\n",
        "got 3 numbers, expected 6",
    ),
    "no such vertex": (HEAD.format("3.0", "ASCII") + "POINTS 1 float\n0 0 0\nLINES 1 3\n2 0 4\n", "expected 0 to 0"),
    "an unknown section": (HEAD.format("3.0", "ASCII") + "BLANKING 1\n", "got 'BLANKING 1'.*; save it as .vtu"),
    "a lattice to come": (
        "# vtk DataFile Version 3.0\na\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 99999 99999 99999\n",
        "bytes to read, but expected at most",
    ),
    "no legacy file": ("a root\n", "got no XML"),
}


@pytest.mark.formats
@pytest.mark.parametrize("text, message", REFUSED.values(), ids=REFUSED)
def test_a_broken_legacy_file_is_refused_and_named(tmp_path, text, message):
    (tmp_path / "a.vtk").write_text(text)
    with pytest.raises(ClipError, match=message) as caught:
        athcodec.read(tmp_path / "a.vtk")
    assert str(tmp_path / "a.vtk") in str(caught.value) and "\n" not in str(caught.value)


# ---- XML ----


def xml_array(name, values, kind="Float64", width=1, more=""):
    return (
        f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{width}" format="ascii" {more}>'
        f"{text_of(values)}</DataArray>"
    )


def xml_piece(points, faces, point_data="", cell_data="", tag="Polys"):
    """A piece of PolyData."""
    nodes, offsets = [node for face in faces for node in face], np.cumsum([len(face) for face in faces])
    return (
        f'<Piece NumberOfPoints="{len(points)}"><Points>{xml_array("Points", points, width=3)}</Points>'
        f"<{tag}>{xml_array('connectivity', nodes, 'Int64')}{xml_array('offsets', offsets, 'Int64')}</{tag}>"
        f"<PointData>{point_data}</PointData><CellData>{cell_data}</CellData></Piece>"
    )


def vtp(*pieces, more="", kind="PolyData"):
    return f'<VTKFile type="{kind}"><{kind}>{more}{"".join(pieces)}</{kind}></VTKFile>'


LEAF, STEM = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 5], [1, 0, 5], [1, 1, 5], [0, 1, 5]]


def test_the_pieces_of_a_file_are_joined(tmp_path):
    age = [xml_array("age", [1, 2, 3]), xml_array("age", [4, 5, 6, 7])]
    text = vtp(
        xml_piece(LEAF, [[0, 1, 2]], age[0] + xml_array("mass", [0] * 3), xml_array("label", [7], "Int32")),
        xml_piece(STEM, [[0, 1, 2, 3]], age[1], xml_array("label", [8], "Int32")),
    )
    (tmp_path / "a.vtp").write_text(text)
    with athcodec.read(tmp_path / "a.vtp") as clip:
        assert clip.block(0, 1)[0].tolist() == LEAF + STEM and polygons_of(clip) == [[0, 1, 2], [3, 4, 5, 6]]
        assert clip.attributes["age"].tolist() == [1, 2, 3, 4, 5, 6, 7] and clip.attributes["label"].tolist() == [7, 8]
        assert clip.metadata["part_names"] == ["a"] and clip.not_read == {"field": ["mass"]}


LISTS = {
    "a.pvtp": '<VTKFile type="PPolyData"><PPolyData><Piece Source="b/0.vtp"/><Piece Source="b/1.vtp"/></PPolyData>'
    "</VTKFile>",
    "a.vtm": '<VTKFile type="vtkMultiBlockDataSet"><vtkMultiBlockDataSet><Block name="tree"><DataSet file="b/0.vtp"/>'
    '</Block><DataSet name="stem" file="b/1.vtp"/></vtkMultiBlockDataSet></VTKFile>',
    "a.vtpd": '<VTKFile type="vtkPartitionedDataSet"><vtkPartitionedDataSet><DataSet file="b/0.vtp"/><DataSet '
    'file="b/1.vtp"/></vtkPartitionedDataSet></VTKFile>',
}


@pytest.mark.formats
@pytest.mark.parametrize("name", LISTS)
def test_the_files_that_a_file_lists_are_joined(tmp_path, name):
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "0.vtp").write_text(vtp(xml_piece(LEAF, [[0, 1, 2]])))
    (tmp_path / "b" / "1.vtp").write_text(vtp(xml_piece(STEM, [[0, 1], [1, 2, 3]], tag="Lines")))
    (tmp_path / name).write_text(LISTS[name])
    with athcodec.read(tmp_path / name) as clip:
        assert clip.block(0, 1)[0].tolist() == LEAF + STEM and clip.faces.tolist() == [[0, 1, 2]]
        assert clip.edges.tolist() == [[3, 4], [4, 5], [5, 6]]
        if name == "a.vtm":
            assert clip.metadata["part_names"] == ["tree", "stem"] and clip.metadata["part_kinds"] == ["mesh", "curves"]
        assert clip.unchanged()
        (tmp_path / "b" / "1.vtp").write_text("")
        assert not clip.unchanged()
    (tmp_path / name).write_text(LISTS[name].replace("b/1.vtp", f"../{tmp_path.name}x/1.vtp"))
    with pytest.raises(ClipError, match="--allow-outside"):
        athcodec.read(tmp_path / name)
    (tmp_path / name).write_text(LISTS[name].replace("b/1.vtp", name))
    with pytest.raises(ClipError, match="lists itself"):
        athcodec.read(tmp_path / name)


@pytest.mark.formats
def test_a_structured_grid_in_xml_is_read(tmp_path):
    points = xml_array("Points", range(18), width=3)
    text = vtp(f'<Piece Extent="0 2 4 5 0 0"><Points>{points}</Points></Piece>', kind="StructuredGrid")
    (tmp_path / "a.vts").write_text(text)
    with athcodec.read(tmp_path / "a.vts") as clip:
        assert clip.faces.tolist() == [[0, 1, 4, 3], [1, 2, 5, 4]] and clip.block(0, 1)[0, 5].tolist() == [15, 16, 17]
    (tmp_path / "a.vts").write_text(text.replace("0 2 4 5", "0 2 4 9"))
    with pytest.raises(ClipError, match="got the extent '0 2 4 9 0 0' of 6 points"):
        athcodec.read(tmp_path / "a.vts")


@pytest.mark.formats
def test_cells_that_vtk_does_not_show_are_left_out_and_named(tmp_path):
    ghosts = xml_array("vtkGhostType", [0, 1, 32, 16], "UInt8") + xml_array("label", [1, 2, 3, 4], "Int32")
    (tmp_path / "a.vtp").write_text(
        vtp(xml_piece(STEM, [[0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]], cell_data=ghosts))
    )
    text = "cells that are hidden or of another piece 2 by vtkGhostType"
    with pytest.warns(SourceWarning, match=text), athcodec.read(tmp_path / "a.vtp") as clip:
        assert clip.faces.tolist() == [[0, 1, 2], [1, 2, 3]] and clip.attributes["label"].tolist() == [1, 4]


@pytest.mark.formats
def test_what_else_a_file_says_is_named(tmp_path):
    array = xml_array("age", [1, 2, 3], more='ComponentName0="years"').replace(
        "</DataArray>", '<InformationKey name="UNITS_LABEL" location="vtkDataArray">a</InformationKey></DataArray>'
    )
    strings = '<Array type="String" Name="species" format="ascii">0</Array>'
    (tmp_path / "a.vtp").write_text(
        vtp(xml_piece(LEAF, [[0, 1, 2]], array + strings), more=f"<FieldData>{strings}</FieldData><Extra/>")
    )
    with athcodec.read(tmp_path / "a.vtp") as clip:
        assert clip.not_read == {
            "field": ["species", "species (field data)"],
            "other": ["Extra", "names of components", "UNITS_LABEL"],
        }


@pytest.mark.formats
def test_an_array_per_point_and_one_per_cell_of_the_same_name_are_both_kept(tmp_path):
    labels = xml_array("label", [1, 2, 3], "Int32"), xml_array("label", [9], "Int32")
    (tmp_path / "a.vtp").write_text(vtp(xml_piece(LEAF, [[0, 1, 2]], *labels)))
    with athcodec.read(tmp_path / "a.vtp") as clip:
        assert clip.attributes["label"].tolist() == [9] and clip.attributes["vertex_label"].tolist() == [1, 2, 3]


@pytest.mark.formats
def test_data_of_cells_that_have_no_place_are_named(tmp_path):
    data = xml_array("label", [1, 2, 3], "Int32")
    (tmp_path / "a.vtp").write_text(vtp(xml_piece(LEAF, [[0], [1], [2]], cell_data=data, tag="Verts")))
    with athcodec.read(tmp_path / "a.vtp") as clip:
        assert clip.not_read == {"field": ["label"]} and clip.metadata["part_kinds"] == ["points"]


@pytest.mark.formats
def test_several_steps_in_one_file_are_refused_with_what_to_do(tmp_path):
    step = xml_array("Points", LEAF, width=3, more='TimeStep="{}"')
    text = vtp(f'<Piece NumberOfPoints="3"><Points>{step.format(0)}{step.format(1)}</Points></Piece>')
    (tmp_path / "a.vtp").write_text(text)
    with pytest.raises(ClipError, match=r"got several time steps in one file .*; save each step as a file"):
        athcodec.read(tmp_path / "a.vtp")
    for suffix in ("vti", "vtr"):
        (tmp_path / f"a.{suffix}").write_text("<VTKFile/>")
        with pytest.raises(ClipError, match="in ParaView, Append Datasets makes it a .vtu"):
            athcodec.read(tmp_path / f"a.{suffix}")


@pytest.mark.formats
def test_only_vectors_are_advised_as_the_displacement_and_the_advice_works(tmp_path):
    for frame in range(2):
        data = xml_array("age", [1, 2, 3]) + xml_array("shift", [[0, 0, frame]] * 3, width=3)
        (tmp_path / f"a_{frame}.vtp").write_text(vtp(xml_piece(LEAF, [[0, 1, 2]], data)))
        (tmp_path / f"b_{frame}.vtp").write_text(vtp(xml_piece(LEAF, [[0, 1, 2]], xml_array("age", [1, 2, 3]))))
    with pytest.raises(ClipError, match="only age, shift; name one of shift with --field"):
        athcodec.read(tmp_path / "a_0.vtp")
    with athcodec.read(tmp_path / "a_0.vtp", field="shift") as clip:
        assert clip.block(0, 2)[:, :, 2].tolist() == [[0, 0, 0], [1, 1, 1]]
    with pytest.raises(ClipError, match="only age; write the displacement with two or three numbers per point"):
        athcodec.read(tmp_path / "b_0.vtp")
