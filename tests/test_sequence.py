"""Numbered OBJ and PLY files: names and numbers, what is kept, what other libraries make of them, broken files."""

from __future__ import annotations

import os

import meshio
import numpy as np
import pytest
import trimesh
from moving_meshes import assert_same_mesh, assert_same_motion, mixed_clip, quad_clip

import athcodec
from athcodec import cli
from athcodec.errors import ClipError, GuessWarning, SourceWarning
from athcodec.files.reading import Budget
from athcodec.motion.clip import MotionClip
from athcodec.sources.mesh_files import parse_mesh

pytestmark = pytest.mark.formats

TRIANGLE = "v 0 0 {}\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def obj(text: str):
    return parse_mesh(text.encode(), "leaf.obj", Budget())


def write_triangles(folder, names):
    for z, name in enumerate(names):
        (folder / name).write_text(TRIANGLE.format(z))


@pytest.mark.parametrize("suffix", [".obj", ".ply"])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("make", [mixed_clip, quad_clip])
def test_a_motion_comes_back_bit_for_bit(tmp_path, suffix, dtype, make):
    clip = make(dtype=dtype)
    athcodec.write(clip, tmp_path / f"tree{suffix}")
    assert sorted(os.listdir(tmp_path)) == [f"tree_000{i}{suffix}" for i in range(1, 7)]
    with athcodec.read(tmp_path / f"tree_0003{suffix}", fps=24) as again:
        assert_same_motion(again, clip)
        assert_same_mesh(again, clip)
        assert again.metadata["fps"] == 24 and again.metadata["start_frame"] == 1
        if "uv" in clip.attributes:
            assert np.array_equal(again.attributes["uv"], clip.attributes["uv"])
            assert again.metadata["domains"]["uv"] == "corner"
        if suffix == ".obj" and make is mixed_clip:
            assert again.metadata == clip.metadata
            assert again.attributes["part_vertex_counts"].tolist() == [5, 3]


def test_what_vertices_have_beside_a_position_comes_back_from_ply(tmp_path):
    clip, count = quad_clip(), 24
    more = {
        "colors": np.arange(3 * count, dtype=np.uint8).reshape(-1, 3),
        "radius": np.linspace(0, 1, count),
        "branch": np.arange(count, dtype=np.int32),
        "uv": np.ones((count, 2), np.float32),
    }
    clip.attributes |= more
    athcodec.write(clip, tmp_path / "tree.ply")
    with athcodec.read(tmp_path / "tree_0001.ply") as again:
        for name, values in more.items():
            assert np.array_equal(again.attributes[name], values) and again.attributes[name].dtype == values.dtype


@pytest.mark.parametrize("named", ["t_2.obj", "t_10.obj", "t_#.obj", "t_%d.obj"])
def test_numbers_without_zeros_and_with_gaps_are_frames(tmp_path, named):
    write_triangles(tmp_path, ["t_2.obj", "t_3.obj", "t_10.obj", "t_x.obj", "u_4.obj", "t_0004.obj.bak"])
    with athcodec.read(tmp_path / named, fps=10) as clip:
        assert clip.metadata["start_frame"] == 2 and np.allclose(clip.time, [0, 0.1, 0.8])
        assert clip.block(0, 3)[:, 0, 2].tolist() == [0, 1, 2]
        athcodec.write(clip, tmp_path / "v.obj")
    assert sorted(path.name for path in tmp_path.glob("v*")) == ["v_0002.obj", "v_0003.obj", "v_0010.obj"]


def test_frame_numbers_may_outgrow_their_leading_zeros(tmp_path):
    write_triangles(tmp_path, ["a099.obj", "a100.obj", "a1000.obj", "a7.obj"])
    for named in ("a###.obj", "a%03d.obj"):
        with athcodec.read(tmp_path / named, fps=1) as clip:
            assert clip.time.tolist() == [0, 1, 901]
    for named in ("a099.obj", "a100.obj", "a1000.obj"):
        with (
            pytest.warns(GuessWarning, match=r"read as 3 of 4 files, without a7\.obj; "),
            athcodec.read(tmp_path / named, fps=1) as clip,
        ):
            assert clip.time.tolist() == [0, 1, 901]


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".vtu"])
@pytest.mark.parametrize(
    "names",
    [
        ["c_-002", "c_-001", "c_000", "c_001"],  # as many digits
        ["c_-02", "c_-01", "c_000", "c_001"],  # as many characters
        ["c_-2", "c_-1", "c_0", "c_10"],
        ["c-2", "c-1", "c0", "c1"],
        ["-002", "-001", "000", "001"],
    ],
)
def test_numbers_below_zero_are_frames_before_those_above(tmp_path, names, suffix):
    for z, name in enumerate(names):
        meshio.write(
            tmp_path / f"{name}{suffix}", meshio.Mesh([[0, 0, z], [1, 0, 0], [0, 1, 0.0]], [("triangle", [[0, 1, 2]])])
        )
    for name in names:
        with athcodec.read(tmp_path / f"{name}{suffix}", fps=1) as clip:
            assert clip.block(0, 4)[:, 0, 2].tolist() == [0, 1, 2, 3] and clip.metadata["start_frame"] == -2


def test_a_hyphen_before_a_number_is_no_sign_where_all_files_have_it(tmp_path):
    write_triangles(tmp_path, ["leaf-001.obj", "leaf-002.obj"])
    with athcodec.read(tmp_path / "leaf-001.obj") as clip:
        assert clip.block(0, 2)[:, 0, 2].tolist() == [0, 1] and clip.metadata["start_frame"] == 1


@pytest.mark.parametrize(
    "names",
    [
        ["leaf0.5.obj", "leaf1.0.obj", "leaf1.5.obj"],
        ["plant_03-20_AM.obj", "plant_03-20_PM.obj", "plant_03-21_AM.obj"],
        ["2024-03-31.obj", "2024-04-01.obj"],
        ["day12.5.obj", "day13.5.obj"],
    ],
)
def test_files_with_decimals_and_dates_that_are_left_out_are_named(tmp_path, names):
    write_triangles(tmp_path, [*names, "leaf.obj", "other_7.obj", "leaf_v2_3.obj", "leaf_v3_3.obj"])
    with pytest.warns(GuessWarning) as said, athcodec.read(tmp_path / names[0]) as clip:
        assert clip.frame_count == 1
    assert f"read as 1 of {len(names)} files, without {', '.join(names[1:])}; " in str(said[0].message)
    for alone in ("leaf.obj", "other_7.obj", "leaf_v2_3.obj"):
        athcodec.read(tmp_path / alone).close()


def test_results_with_dates_in_their_names_that_are_left_out_are_named(tmp_path, capsys):
    for day in (30, 31, 1):
        mesh = meshio.Mesh([[0, 0, day], [1, 0, 0], [0, 1, 0.0]], [("triangle", [[0, 1, 2]])])
        meshio.write(tmp_path / f"plant_{3 if day > 1 else 4}-{day}.vtu", mesh)
    path, encoded = tmp_path / "plant_3-30.vtu", tmp_path / "a.ath"
    assert cli.main(["encode", str(path), str(encoded), "--effort", "fast"]) == 0
    assert f"warning: {path}: read as 2 of 3 files, without plant_4-1.vtu; frames differ" in capsys.readouterr().err


PLY_VALUES = {"uchar red": 0, "uchar green": 9, "uchar blue": 9, "int organ": 5, "float s": 0.25, "float t": 0.5}


def write_changing(folder, kind, changing):
    """Three squares with colours, organs and texture coordinates, of which some change in the second file."""
    for frame in range(3):
        values = {name: value + (frame == 1 and name.split()[1] in changing) for name, value in PLY_VALUES.items()}
        corners = [(x, y, frame) for x in (0, 1) for y in (0, 1)]
        if kind == "obj":
            lines = [f"v {x} {y} {z} {values['uchar red']} 1 1" for x, y, z in corners]
            lines += [f"vt {values['float s']} 0"] * 4 + [f"usemtl m{frame == 1 and 'material' in changing}"]
            (folder / f"a_{frame}.obj").write_text("\n".join([*lines, "f 1/1 2/2 4/4 3/3\n"]))
            continue
        columns = {**dict(zip(("float x", "float y", "float z"), np.transpose(corners))), **values}
        types = {"uchar": "u1", "int": "<i4", "float": "<f4"}
        rows = np.zeros(4, [(name.split()[1], types[name.split()[0]]) for name in columns])
        for name, column in columns.items():
            rows[name.split()[1]] = column
        header = "".join(f"property {name}\n" for name in columns)
        face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        form = {"ascii": "ascii", "binary": "binary_little_endian"}[kind]
        head = f"ply\nformat {form} 1.0\nelement vertex 4\n{header}{face}".encode()
        body = rows.tobytes() + b"\4" + np.array([0, 1, 3, 2], "<i4").tobytes()
        if kind == "ascii":
            body = "\n".join(" ".join(map(str, row)) for row in rows.tolist()).encode() + b"\n4 0 1 3 2\n"
        (folder / f"a_{frame}.ply").write_bytes(head + body)
    return folder / ("a_0.obj" if kind == "obj" else "a_0.ply")


@pytest.mark.parametrize("kind", ["ascii", "binary", "obj"])
def test_arrays_that_change_in_a_single_file_are_named_and_others_stay(tmp_path, kind):
    names = {"red": "colors", "s": "uv"} | ({"material": "face_material"} if kind == "obj" else {"organ": "organ"})
    for changing in ([], *([name] for name in names), list(names)):
        with athcodec.read(write_changing(tmp_path, kind, changing)) as clip:
            changed = sorted(names[name] for name in changing)
            assert clip.not_read.get("attribute", []) == changed
            assert clip.attributes.keys() >= set(names.values()) - set(changed)
            assert not clip.attributes.keys() & set(changed)
            assert clip.block(0, 3)[:, 0, 2].tolist() == [0, 1, 2]


def test_a_single_file_is_a_single_frame(tmp_path):
    write_triangles(tmp_path, ["leaf.obj", "leaf_0001.obj"])
    with athcodec.read(tmp_path / "leaf.obj") as clip:
        assert clip.frame_count == 1 and "start_frame" not in clip.metadata
        athcodec.write(clip, tmp_path / "copy.obj")
    assert (tmp_path / "copy.obj").exists()


def test_changing_topology_is_refused_with_the_frame(tmp_path):
    for text, message in (
        ("v 0 0 1\nv 1 0 0\nv 0 1 0\nf 1 3 2\n", "got other faces"),
        (TRIANGLE.format(1) + "v 1 1 1\n", "got 4 vertices, expected 3"),
        (TRIANGLE.format(1) + "l 1 2\n", "got further edges"),
        ("v 0 0 1\nv 1 0 0\nv 0 1 0\n", "got no faces"),
    ):
        write_triangles(tmp_path, [f"a_{i}.obj" for i in range(4)])
        (tmp_path / "a_2.obj").write_text(text)
        with athcodec.read(tmp_path / "a_0.obj") as clip:
            with pytest.raises(ClipError, match=rf"frame 2, a_2\.obj: {message}"):
                list(clip.blocks())


def test_changing_topology_of_ply_is_refused_with_the_frame(tmp_path):
    athcodec.write(quad_clip(frames=4), tmp_path / "a.ply")
    other = athcodec.write(mixed_clip(frames=1), tmp_path / "other.ply").files[0]
    other.rename(tmp_path / "a_0003.ply")
    with athcodec.read(tmp_path / "a_0001.ply") as clip:
        with pytest.raises(ClipError, match=r"a_0003\.ply: got .*topology that changes"):
            list(clip.blocks())


def test_normals_and_names_that_change_from_file_to_file_are_no_topology(tmp_path):
    for i in range(3):
        (tmp_path / f"a_{i}.obj").write_text(
            f"mtllib a_{i}.mtl\no leaf{i}\nv 0 0 {i}\nv 1 0 0\nv 0 1 0\nvn 0 0 1\n"
            + "vn 1 0 0\n" * i
            + f"f 1//{i + 1} 2//1 3//1\n"
        )
    with athcodec.read(tmp_path / "a_1.obj") as clip:
        assert clip.block(0, 3)[:, 0, 2].tolist() == [0, 1, 2] and clip.faces.tolist() == [[0, 1, 2]]


def test_obj_with_comments_continuations_and_relative_numbers_is_read():
    mesh = obj(
        "# a leaf\r\nv  0 0 0 1 0 0\r\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\nvt 0 0\nvt 1 0 0\nvt 1 1\n"
        "usemtl green\nf -4/1/1 -3/2/1 \\\n -2/3/1\nusemtl bark\nf 1 3 4\nl 1 2 3\np 4\ns off\ncstype bezier\n"
    )
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]] and mesh.edges.tolist() == [[0, 1], [1, 2]]
    assert mesh.attributes["colors"].tolist()[3] == [1, 1, 1] and mesh.points.dtype == np.float32
    assert mesh.attributes["uv"].tolist() == [[0, 0], [1, 0], [1, 1], [0, 0], [0, 0], [0, 0]]
    assert mesh.attributes["face_material"].tolist() == [0, 1]
    assert mesh.metadata["material_names"] == ["green", "bark"] and mesh.metadata["part_names"] == ["leaf"]


def test_statements_and_elements_that_are_not_read_are_named(tmp_path):
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\ns off\nf 1//1 2//1 3//1\n")
    with athcodec.read(tmp_path / "a.obj") as clip:
        assert clip.not_read == {"statement": ["mtllib", "vn", "s"]}
    with (tmp_path / "a.obj").open("a") as file:
        file.write("cstype bezier\ncurv 0 1 1 2 3\n")
    with pytest.warns(SourceWarning, match="curve or surface curv$"), athcodec.read(tmp_path / "a.obj") as clip:
        assert clip.faces.tolist() == [[0, 1, 2]]
    (tmp_path / "a.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
        "element camera 1\nproperty float fov\nend_header\n1 2 3\n50\n"
    )
    with athcodec.read(tmp_path / "a.ply") as clip:
        assert clip.not_read == {"element": ["camera"]}


OBJ_SAYS = {
    "v 0 0 0 1\nv 1 0 0 2\nv 0 1 0 1\nf 1 2 3\n": {"attribute": ["numbers behind the coordinates of v"]},
    "v 0 0 0 1 1 1\nv 1 0 0\nv 0 1 0\nf 1 2 3\n": {"attribute": ["numbers behind the coordinates of v"]},
    TRIANGLE.format(0) + "vt 0 1\n": {"statement": ["vt"]},
    "vt 0 1 0.5\n" + TRIANGLE.format(0).replace("1 2 3", "1/1 2/1 3/1"): {"statement": ["w of vt"]},
    TRIANGLE.format(0) + "vt 0 0\nl 1/1 2/1\n": {"statement": ["vt of l", "vt"]},
    "o a\ng one\n" + TRIANGLE.format(0): {"statement": ["g"]},
    "o a\n" + TRIANGLE.format(0) + "o b\nf 3 2 1\n": {"statement": ["o"]},
    TRIANGLE.format(0) + "c_interp on\n@x\n#MRGB 00ff\n# a comment\n": {"statement": ["c_interp", "@x", "#MRGB"]},
}


@pytest.mark.parametrize("text", OBJ_SAYS)
def test_whatever_an_obj_file_says_and_is_not_read_is_named(tmp_path, text):
    (tmp_path / "a.obj").write_text(text)
    with athcodec.read(tmp_path / "a.obj") as clip:
        assert clip.not_read == OBJ_SAYS[text]


@pytest.mark.parametrize("line, kind", [("curv2 1 2", "curve or surface"), ("call b.obj", "included file")])
def test_shapes_of_an_obj_file_that_are_not_read_are_said(tmp_path, line, kind):
    (tmp_path / "a.obj").write_text(TRIANGLE.format(0) + line + "\n")
    with pytest.warns(SourceWarning, match=f"not read: {kind} {line.split()[0]}$"):
        athcodec.read(tmp_path / "a.obj").close()


def test_statements_of_later_files_are_named_too(tmp_path):
    write_triangles(tmp_path, ["a_1.obj", "a_2.obj", "a_3.obj"])
    with (tmp_path / "a_3.obj").open("a") as file:
        file.write("surf 0 1 0 1 1\n")
    with (
        pytest.warns(SourceWarning, match="not read: curve or surface surf$"),
        athcodec.read(tmp_path / "a_1.obj") as clip,
    ):
        assert clip.frame_count == 3


PLY_SAYS = {
    "element edge 1\nproperty int vertex1\nproperty int vertex2\nproperty float crease\n|0 1 0.5": {
        "attribute": ["edge_crease"]
    },
    "element edge 1\nproperty int from\nproperty int to\n|0 1": {"attribute": ["edge_from", "edge_to"]},
    "comment TextureFile leaf.png\n|": {"statement": ["TextureFile"]},
}


@pytest.mark.parametrize("more", PLY_SAYS)
def test_whatever_a_ply_file_says_and_is_not_read_is_named(tmp_path, more):
    header, rows = more.split("|")
    (tmp_path / "a.ply").write_text(PLY.format("ascii", 2, header) + f"0 0 0\n1 0 0\n{rows}\n")
    with athcodec.read(tmp_path / "a.ply") as clip:
        assert clip.not_read == PLY_SAYS[more]


@pytest.mark.parametrize("element, named", [("vertex", "x"), ("edge", "vertex1"), ("vertex", "red")])
def test_a_list_where_ply_has_one_number_is_refused_or_named(tmp_path, element, named):
    columns = {"vertex": ["x", "y", "z", "red", "green", "blue"], "edge": ["vertex1", "vertex2"]}
    header, rows = "ply\nformat ascii 1.0\n", ""
    for name, count in (("vertex", 2), ("edge", 1)):
        is_list = [name == element and column == named for column in columns[name]]
        kinds = ["list uchar int" if listed else "int" for listed in is_list]
        header += f"element {name} {count}\n" + "".join(f"property {k} {c}\n" for k, c in zip(kinds, columns[name]))
        rows += count * (" ".join("1 0" if listed else "0" for listed in is_list) + "\n")
    (tmp_path / "a.ply").write_text(f"{header}end_header\n{rows}")
    if named == "x":
        with pytest.raises(ClipError, match=r"a\.ply: got no vertices with x, y and z"):
            athcodec.read(tmp_path / "a.ply")
        return
    with athcodec.read(tmp_path / "a.ply") as clip:
        assert any(named in name for name in clip.not_read["attribute"])


def test_normals_and_faces_without_known_corners_of_a_ply_file_are_named(tmp_path):
    normals = "".join(f"property float n{axis}\n" for axis in "xyz")
    faces = "element face 1\nproperty list int int corners\nproperty int organ\n"
    (tmp_path / "a.ply").write_text(PLY.format("ascii", 3, normals + faces) + 3 * "0 0 0 0 0 1\n" + "3 0 1 2 7\n")
    with pytest.warns(SourceWarning, match="not read: faces whose corners have no known name corners, organ"):
        with athcodec.read(tmp_path / "a.ply") as clip:
            assert clip.not_read["attribute"] == ["normals"] and clip.polygons is None


def test_objects_and_groups_are_parts_where_their_vertices_lie_together():
    squares = "v 0 0 0\nv 1 0 0\nv 0 1 0\n{}v 0 0 1\nv 1 0 1\nv 0 1 1\n{}"
    for word in ("o", "g"):
        mesh = obj(f"{word} leaf one\n" + squares.format(f"f 1 2 3\n{word} twig\n", "f 4 5 6\n"))
        assert mesh.metadata["part_names"] == ["leaf one", "twig"]
        assert mesh.attributes["part_vertex_counts"].tolist() == [3, 3]
    behind = obj(squares.format("", "g leaf\nf 1 2 3\ng twig\nl 4 5 6\n"))
    assert behind.metadata["part_kinds"] == ["mesh", "curves"]
    shared = obj(squares.format("", "g a\nf 1 2 6\ng b\nf 3 4 5\n"))
    assert shared.metadata["part_names"] == ["leaf"] and shared.attributes["face_group"].tolist() == [0, 1]
    assert shared.metadata["group_names"] == ["a", "b"]
    covered = obj(squares.format("", "g a\nf 1 2 3\ng b\nf 3 2 1\n"))  # All vertices are those of the first group.
    assert covered.metadata["group_names"] == ["a", "b"] and covered.attributes["face_group"].tolist() == [0, 1]


def test_digits_beyond_float32_are_kept():
    assert obj("v 123456.7890123 0 0\n").points[0, 0] == 123456.7890123
    assert obj("v 0.000123456000 -1.25e-10 12.3456780\n").points.dtype == np.float32


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
def test_ply_files_of_other_libraries_are_read(tmp_path, form):
    clip = mixed_clip()
    cells = [("quad", [[0, 1, 2, 3]]), ("triangle", clip.polygons[1][4:].reshape(-1, 3))]
    for frame, points in enumerate(clip.block(0, 6)):
        meshio.write(tmp_path / f"m_{frame}.ply", meshio.Mesh(points, cells), binary=form != "ascii")
    with athcodec.read(tmp_path / "m_0.ply", fps=24) as again:
        assert_same_motion(again, clip)
        assert all(map(np.array_equal, again.polygons, clip.polygons))
    triangles = trimesh.Trimesh(clip.block(5, 6)[0], [[0, 1, 4], [1, 2, 4]], process=False)
    triangles.export(tmp_path / "t.ply", encoding="ascii" if form == "ascii" else "binary", vertex_normal=True)
    with athcodec.read(tmp_path / "t.ply") as again:
        assert np.allclose(again.block(0, 1)[0], clip.block(5, 6)[0], rtol=0, atol=1e-7)
        assert again.faces.tolist() == [[0, 1, 4], [1, 2, 4]] and "nx" not in again.attributes


def test_obj_files_of_other_libraries_are_read(tmp_path):
    clip = quad_clip()
    for frame, points in enumerate(clip.block(0, 6)):
        meshio.write(tmp_path / f"m{frame:03}.obj", meshio.Mesh(points, [("quad", clip.faces)]))
    with athcodec.read(tmp_path / "m###.obj", fps=24) as again:
        assert_same_motion(again, clip, 1e-6)
        assert np.array_equal(again.faces, clip.faces)
    triangles = trimesh.Trimesh(clip.block(0, 1)[0], clip.faces[:, :3], process=False)
    triangles.export(tmp_path / "t.obj", include_normals=True)
    with athcodec.read(tmp_path / "t.obj") as again:
        assert np.array_equal(again.faces, clip.faces[:, :3]) and np.allclose(again.block(0, 1)[0], triangles.vertices)


@pytest.mark.parametrize("suffix", [".obj", ".ply"])
def test_other_libraries_read_what_is_written(tmp_path, suffix):
    clip = quad_clip()
    athcodec.write(clip, tmp_path / f"tree{suffix}")
    for frame, wanted in enumerate(clip.block(0, 6), 1):
        path = tmp_path / f"tree_000{frame}{suffix}"
        theirs = meshio.read(path)
        assert np.array_equal(theirs.points.astype(np.float32), wanted)
        assert np.array_equal(theirs.cells_dict["quad"], clip.faces)
        loaded = trimesh.load(path, process=False, maintain_order=True)
        assert np.allclose(loaded.vertices, wanted, rtol=0, atol=1e-7)


def test_a_path_may_say_how_files_are_numbered(tmp_path):
    for path, first in (("a.##.obj", "a.01.obj"), ("b%03d.ply", "b001.ply"), ("c_00.obj", "c_01.obj")):
        athcodec.write(quad_clip(frames=2), tmp_path / path)
        assert first in os.listdir(tmp_path)


def test_times_between_frames_number_the_files_from_one(tmp_path):
    clip = MotionClip(quad_clip(frames=3).block(0, 3), np.array([0, 0.1, 0.35]))
    athcodec.write(clip, tmp_path / "a.obj")
    assert sorted(os.listdir(tmp_path)) == ["a_0001.obj", "a_0002.obj", "a_0003.obj"]


def test_files_of_another_motion_are_not_mixed_in(tmp_path):
    athcodec.write(quad_clip(frames=5), tmp_path / "a.obj")
    before = {name: (tmp_path / name).read_bytes() for name in os.listdir(tmp_path)}
    with pytest.raises(ClipError, match=r"a_0004\.obj: is there already and no frame of the clip"):
        athcodec.write(quad_clip(frames=3, dtype=np.float64), tmp_path / "a.obj")
    assert {name: (tmp_path / name).read_bytes() for name in os.listdir(tmp_path)} == before
    athcodec.write(quad_clip(frames=6), tmp_path / "a.obj")
    assert len(os.listdir(tmp_path)) == 6


PLY = "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n{}end_header\n"
FACES = "element face {}\nproperty list int int vertex_indices\n"
REFUSED = {
    "no vertices": ("a.obj", "f 1 2 3\n", "got no vertices"),
    "no such vertex": ("a.obj", "v 0 0 0\nf 1 2 3\n", "faces: got the number 1"),
    "vertex 0": ("a.obj", "v 0 0 0\nf 0 0 0\n", "got the number 0"),
    "two coordinates": ("a.obj", "v 0 0\n", "fewer than three"),
    "no number": ("a.obj", "v 0 0 x\n", "could not convert"),
    "too large": ("a.obj", "v 0 0 1e40\n", "frame 0, vertex 0"),
    "no PLY": ("a.ply", "v 0 0 0\n", "expected a PLY file"),
    "no end": ("a.ply", "ply\nformat ascii 1.0\n", "no end of the header"),
    "vertices to come": ("a.ply", PLY.format("ascii", 10**12, ""), "end of the file"),
    "binary to come": ("a.ply", PLY.format("binary_big_endian", 10**15, ""), "end of the file"),
    "lists to come": ("a.ply", PLY.format("ascii", 1, FACES.format(1)) + "0 0 0\n2000000000 1 2 3", "got a list of"),
    "negative list": ("a.ply", PLY.format("ascii", 1, FACES.format(1)) + "0 0 0\n-1 1 2 3", "got a list of -1"),
    "longer lines": ("a.ply", PLY.format("ascii", 2, "") + "0 0 0 9\n1 1 1 9\n", "got 2 more words behind the last"),
    "another type": ("a.ply", PLY.format("ascii", 1, "property quad w\n") + "0 0 0 0\n", "expected a type of PLY"),
}


@pytest.mark.parametrize("name, text, message", REFUSED.values(), ids=REFUSED)
def test_a_broken_file_is_refused_and_named(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(ClipError, match=message) as caught:
        athcodec.read(tmp_path / name)
    assert str(tmp_path / name) in str(caught.value)


def test_missing_files_are_reported(tmp_path):
    with pytest.raises(ClipError, match="got no such files, expected some like a_0001.obj"):
        athcodec.read(tmp_path / "a_####.obj")
    with pytest.raises(FileNotFoundError):
        athcodec.read(tmp_path / "a_0001.obj")
