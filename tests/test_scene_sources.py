"""USD, glTF and Alembic: what a file says beyond what readers usually look at is read, or it is named.

Files are written here by text or by the format's library; values come from closed forms, or from USD's evaluation.
docs/what-is-read.md has the tables that these tests hold.
"""

from __future__ import annotations

import gc
import re
import warnings
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from glb import COMPONENTS, TYPES, apart, glb

import athcodec
from athcodec.cli import main
from athcodec.errors import ClipError, GuessWarning, SourceWarning
from athcodec.sources import ReadOptions

LEAF = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 2], [0, 0, 2.5]])


def frames_of(clip):
    with closing(clip):
        return clip.block(0, clip.frame_count).astype(np.float64)


def about_y(degrees):
    """(k, 3, 3) that turn rows about the second axis."""
    angle = np.radians(np.atleast_1d(degrees))
    cosine, sine, zero, one = np.cos(angle), np.sin(angle), np.zeros(len(angle)), np.ones(len(angle))
    rows = [[cosine, zero, -sine], [zero, one, zero], [sine, zero, cosine]]
    return np.array(rows).transpose(2, 0, 1)


# ---- USD ----

CORNERS = "int[] faceVertexCounts = [4]\n    int[] faceVertexIndices = [0, 1, 2, 3]\n"


def vectors(points):
    return "[" + ", ".join(f"({x:.9g}, {y:.9g}, {z:.9g})" for x, y, z in points) + "]"


def mesh(more="", points=LEAF, name="leaf", metadata=""):
    """The text of a mesh; points: (4, 3), or those of each time code."""
    if isinstance(points, dict):
        samples = "".join(f"\n        {code}: {vectors(each)}," for code, each in points.items())
        value = f".timeSamples = {{{samples}\n    }}"
    else:
        value = f" = {vectors(points)}"
    return f'def Mesh "{name}" {metadata}\n{{\n    point3f[] points{value}\n    {CORNERS}{more}\n}}\n'


def spline(name, knots, kind="linear", more=""):
    """The text of a spline through these knots, {time code: value}."""
    slope = "" if kind == "linear" else "pre (2, 0); "
    after = "post linear" if kind == "linear" else "post curve (2, 0)"
    lines = "".join(f"        {code}: {value}; {slope}{after},\n" for code, value in knots.items())
    return f"    float {name}.spline = {{\n        {kind if kind == 'bezier' else 'bezier'},\n{more}{lines}    }}\n"


TURNED = '    uniform token[] xformOpOrder = ["xformOp:rotateY"]'


def layer(path, *prims, **metadata):
    """Write a layer of these prims and return its path. Metadata are as USD's text has them."""
    lines = "".join(f"    {key} = {value}\n" for key, value in ({"timeCodesPerSecond": 24} | metadata).items())
    path.write_text(f"#usda 1.0\n(\n{lines})\n\n" + "\n".join(prims))
    return path


def opened(path, **options):
    """The clip in a USD or Alembic file, read in this process."""
    from athcodec.sources import alembic_archive, usd_stage

    module = alembic_archive if path.suffix == ".abc" else usd_stage
    return module.open_clip(str(path), ReadOptions(**options))


def test_splines_of_a_stage_without_a_range_are_read_over_all_knots_and_samples(tmp_path):
    knots = {1: 0, 13: 30, 25: -10}
    angles = np.interp(np.arange(1, 26), list(knots), list(knots.values()))
    turned = spline("xformOp:rotateY", knots) + TURNED
    clip = opened(layer(tmp_path / "a.usda", mesh(turned)))
    assert clip.metadata["start_frame"] == 1 and np.allclose(clip.time, np.arange(25) / 24)
    assert np.abs(frames_of(clip) - LEAF @ about_y(angles)).max() < 1e-6
    growing = {code: LEAF * [1, 1, code] for code in (4, 7)}
    height = np.interp(np.arange(1, 26), [4, 7], [4, 7])[:, None, None]
    clip = opened(layer(tmp_path / "b.usda", mesh(turned, growing)))
    ones = np.ones((25, 1, 1))
    expected = LEAF * np.concatenate([ones, ones, height], axis=2) @ about_y(angles)
    assert np.abs(frames_of(clip) - expected).max() < 1e-5 and not clip.not_read


def test_keys_outside_of_the_range_of_a_stage_are_named(tmp_path):
    points = {code: LEAF + [code, 0, 0] for code in (1, 5, 9)}
    path = layer(tmp_path / "a.usda", mesh("", points), startTimeCode=3, endTimeCode=6)
    with opened(path) as clip:
        assert clip.frame_count == 4
        assert clip.not_read == {
            "keys outside of the stage's range": ["time codes 1 to 9 (2 keys; the range is 3 to 6)"]
        }
    path = layer(tmp_path / "b.usda", mesh("", points), startTimeCode=9, endTimeCode=1)
    with opened(path) as clip:
        assert clip.frame_count == 3 and clip.not_read == {"range of the stage": ["9 to 1, which runs backward"]}


def instancer(name, prototype, prims, more=""):
    head = f'def PointInstancer "{name}"\n{{\n    point3f[] positions = [(0, 0, 0), (2, 0, 0)]\n'
    return f"{head}    int[] protoIndices = [0, 0]\n    rel prototypes = <{prototype}>\n{more}{prims}}}\n"


def test_what_is_there_is_named_where_nothing_of_it_can_be_read(tmp_path):
    ball = instancer("dust", "/dust/ball", 'def Sphere "ball"\n{\n    double radius = 0.1\n}\n')
    inner = instancer("twig", "/wood/twig/leaf", mesh())
    wood = instancer("wood", "/wood/twig", inner)
    with pytest.raises(ClipError, match="got none with points.*; not read: Sphere /dust/ball") as refused:
        opened(layer(tmp_path / "a.usda", ball, wood))
    assert "PointInstancer inside a PointInstancer /wood/twig" in str(refused.value)
    with opened(layer(tmp_path / "b.usda", ball, wood, mesh())) as clip:
        assert clip.metadata["part_names"] == ["leaf"]
        assert clip.not_read == {"Sphere": ["/dust/ball"], "PointInstancer inside a PointInstancer": ["/wood/twig"]}
    with pytest.raises(ClipError, match="named like bark, .*, or /leaf; not read: Sphere"):
        opened(tmp_path / "b.usda", only=["bark"])


OTHERS = """
def Xform "tree" (
    variants = {
        string season = "summer"
    }
    prepend variantSets = "season"
)
{
    custom double wind = 3
    double3 xformOp:translate = (1, 2, 3)
    rel material:binding = </gone>
    variantSet "season" = {
        "summer" {
        }
        "winter" {
        }
    }
}

def "far" (
    prepend payload = @none.usda@
)
{
}

over "old"
{
    float height = 3
}
"""


def test_what_composition_leaves_out_is_named(tmp_path):
    absent, template = mesh(name="absent", metadata="(active = false)"), mesh(name="model").replace("def", "class")
    with opened(layer(tmp_path / "a.usda", mesh(), OTHERS, absent, template)) as clip:
        assert clip.metadata["part_names"] == ["leaf"]
        [missing] = clip.not_read.pop("missing")
        assert "none.usda" in missing
        assert clip.not_read == {
            "attribute": [
                "/tree.wind",
                "/tree.xformOp:translate (not in xformOpOrder)",
                "/tree.material:binding (there is no /gone)",
            ],
            "inactive": ["/absent"],
            "variant": ["/tree season: winter (summer is read)"],
            "over of no prim": ["/old"],
            "class that nothing inherits": ["/model"],
        }


@pytest.mark.formats
def test_splines_are_read_as_usd_evaluates_them_through_layers_and_references(tmp_path):
    from pxr import Usd, UsdGeom

    knots = {0: 0, 3: 50, 8: -20}
    bent = spline("xformOp:rotateY", knots, "bezier") + TURNED
    layer(tmp_path / "leaf.usda", mesh(bent), defaultPrim='"leaf"')
    moved = 'def "late" (\n    prepend references = @leaf.usda@ (offset = 10; scale = 2)\n)\n{\n}\n'
    twice = 'def "again" (\n    prepend references = @leaf.usda@\n)\n{\n}\n'
    path = layer(tmp_path / "a.usda", moved, twice)
    clip = opened(path)
    assert clip.metadata["start_frame"] == 0 and clip.frame_count == 27 and not clip.not_read  # 10 + 2 * 8
    stage = Usd.Stage.Open(str(path))
    for frame, found in enumerate(frames_of(clip)):
        for name, own in (("late", found[:4]), ("again", found[4:])):
            matrix = UsdGeom.Xformable(stage.GetPrimAtPath(f"/{name}")).ComputeLocalToWorldTransform(frame)
            expected = [matrix.Transform(tuple(map(float, point))) for point in LEAF]
            assert np.abs(own - expected).max() < 1e-6


@pytest.mark.formats
def test_motion_beyond_the_knots_and_splines_of_arrays_are_named(tmp_path):
    loops = spline("xformOp:rotateY", {1: 0, 5: 90}, more="        post: loop repeat,\n") + TURNED
    wet = spline("primvars:wet", {1: 0, 3: 1, 5: 0})
    with opened(layer(tmp_path / "a.usda", mesh(loops + "\n" + wet))) as clip:
        assert clip.frame_count == 5 and "wet" not in clip.attributes
        assert clip.not_read == {
            "motion beyond the knots of splines": ["/leaf.xformOp:rotateY"],
            "attribute": ["/leaf.wet"],
        }
    with opened(layer(tmp_path / "b.usda", mesh(loops), startTimeCode=1, endTimeCode=9)) as clip:
        assert np.abs(clip.block(5, 6) - LEAF @ about_y(112.5)).max() < 1e-6 and not clip.not_read
    colours = (
        "    color3f[] primvars:displayColor.timeSamples = {\n        1: [(0, 0, 0)],\n        5: [(1, 1, 1)],\n    }\n"
    )
    with opened(layer(tmp_path / "c.usda", mesh(colours))) as clip:
        assert clip.frame_count == 1 and clip.not_read == {"attribute": ["/leaf.displayColor"]}


@pytest.mark.formats
def test_frames_are_those_of_frames_per_second_where_time_codes_miss_keys(tmp_path):
    points = {code: LEAF + [code, 0, 0] for code in (0, 0.25, 1)}
    span = {"startTimeCode": 0, "endTimeCode": 1, "timeCodesPerSecond": 1}
    clip = opened(layer(tmp_path / "a.usda", mesh("", points), framesPerSecond=24, **span))
    assert clip.metadata["fps"] == 24 and clip.frame_count == 25 and clip.metadata["start_frame"] == 0
    assert np.allclose(frames_of(clip)[:, 0, 0], np.arange(25) / 24, atol=1e-6)
    turned = mesh(spline("xformOp:rotateY", {0: 0, 1: 60}) + TURNED)
    clip = opened(layer(tmp_path / "b.usda", turned, framesPerSecond=30, timeCodesPerSecond=1))
    assert clip.metadata["fps"] == 30 and np.abs(frames_of(clip) - LEAF @ about_y(np.arange(31) * 2)).max() < 1e-5
    points = {code: LEAF + [code, 0, 0] for code in (0, 1, 2)}
    with opened(layer(tmp_path / "c.usda", mesh("", points), framesPerSecond=60)) as clip:
        assert clip.frame_count == 3 and clip.metadata["fps"] == 24
        assert clip.not_read == {"framesPerSecond": ["60 (frames are time codes, 24 per second)"]}


@pytest.mark.formats
def test_value_clips_are_read_and_those_that_are_not_there_are_named(tmp_path):
    clips = """(
    clips = {
        dictionary default = {
            double2[] active = [(0, 0)]
            asset[] assetPaths = [@%s.usda@]
            asset manifestAssetPath = @manifest.usda@
            string primPath = "/leaf"
            double2[] times = [(0, 0), (4, 4)]
        }
    }
)"""
    layer(tmp_path / "cache.usda", mesh("", {code: LEAF + [code, 0, 0] for code in range(5)}))
    layer(tmp_path / "manifest.usda", 'over "leaf"\n{\n    point3f[] points\n}\n')
    bare = mesh("", metadata=clips % "cache").replace(f" = {vectors(LEAF)}", "")
    clip = opened(layer(tmp_path / "a.usda", bare))
    assert not clip.not_read and np.allclose(frames_of(clip), LEAF + np.arange(5)[:, None, None] * [1, 0, 0])
    (tmp_path / "cache.usda").unlink()
    with opened(layer(tmp_path / "b.usda", mesh("", metadata=clips % "lost"))) as clip:
        assert clip.not_read == {"missing": ["value clip @lost.usda@ of /leaf"]}


@pytest.mark.formats
def test_every_type_of_prim_that_usd_has_is_read_or_named(tmp_path):
    from pxr import Tf, Usd

    kinds = {
        Usd.SchemaRegistry.GetConcreteSchemaTypeName(each)
        for each in Tf.Type.FindByName("UsdTyped").GetAllDerivedTypes()
    }
    kinds -= {""}
    shaped = {"Mesh", "Points", "BasisCurves", "HermiteCurves", "NurbsCurves"}
    structure = {"Xform", "Scope", "SkelRoot", "Skeleton", "BlendShape"}  # They show nothing themselves.
    assert len(kinds) > 40 and shaped | structure < kinds
    path = layer(tmp_path / "a.usda", mesh(), *(f'def {kind} "_{kind}"\n{{\n}}\n' for kind in sorted(kinds)))
    with opened(path) as clip:
        assert clip.metadata["part_names"] == ["leaf"]
        named = {name for names in clip.not_read.values() for name in names}
    assert {f"/_{kind}" for kind in kinds} - named == {f"/_{kind}" for kind in structure}
    assert {f"/_{kind}" for kind in shaped} <= set(clip.not_read["empty"])


@pytest.mark.formats
def test_instancers_name_prototypes_that_are_unused_and_missing_and_indices_that_lead_nowhere(tmp_path):
    prims = mesh() + mesh(name="spare") + mesh(name="loose")
    spare = instancer("a", "/a/leaf>, </a/spare", prims).replace("rel prototypes = <", "rel prototypes = [<")
    gone = instancer("b", "/b/none", "")
    far = instancer("c", "/c/leaf", mesh()).replace("[0, 0]", "[0, 7]")
    path = layer(tmp_path / "a.usda", spare.replace("spare>", "spare>]"), gone, far, 'def PointInstancer "d"\n{\n}\n')
    with opened(path) as clip:
        assert clip.metadata["part_names"] == ["leaf"] and clip.attributes["part_copies"].tolist() == [2]
        assert clip.not_read == {
            "hidden": ["/a/spare", "/a/loose"],
            "missing": ["prototype /b/none of /b"],
            "PointInstancer": ["/c (protoIndices are 0 to 7, of 1 prototypes)"],
            "empty": ["/d"],
        }


@pytest.mark.formats
def test_native_instances_are_read_each_and_what_is_left_out_of_them_is_named_once(tmp_path):
    model = (
        'class Xform "model"\n{\n'
        + instancer("many", "/model/many/leaf", mesh())
        + 'def Cone "tip"\n{\n}\n'
        + mesh(name="old", metadata="(active = false)")
        + "}\n"
    )
    shown = "".join(
        f'def "{name}" (\n    instanceable = true\n    prepend inherits = </model>\n)\n{{\n'
        f"    double3 xformOp:translate = ({place}, 0, 0)\n"
        '    uniform token[] xformOpOrder = ["xformOp:translate"]\n}\n'
        for name, place in (("a", 0), ("b", 10))
    )
    with opened(layer(tmp_path / "a.usda", model, shown)) as clip:
        assert clip.attributes["part_copies"].tolist() == [2, 2]
        found = clip.block(0, 1).reshape(4, 4, 3)
        assert clip.not_read == {"Cone": ["/a/tip", "/b/tip"], "inactive": ["/a/old"]}
    assert np.allclose(found, LEAF + np.array([0, 2, 10, 12])[:, None, None] * [1, 0, 0])


@pytest.mark.formats
def test_layers_of_a_package_that_the_first_one_does_not_lead_to_are_named(tmp_path):
    from pxr import Sdf

    layer(tmp_path / "used.usda", mesh())
    layer(tmp_path / "spare.usda", mesh(name="spare"))
    layer(tmp_path / "first.usda", subLayers="[@./used.usda@]")
    with Sdf.ZipFileWriter.CreateNew(str(tmp_path / "a.usdz")) as package:
        for name in ("first.usda", "used.usda", "spare.usda"):
            package.AddFile(str(tmp_path / name), name)
    with opened(tmp_path / "a.usdz") as clip:
        assert clip.metadata["part_names"] == ["leaf"] and clip.not_read == {"layer": ["spare.usda"]}


@pytest.mark.formats
def test_skinning_that_moves_nothing_and_normals_that_turn_are_named(tmp_path):
    bound = '    int[] primvars:skel:jointIndices = [0, 0, 0, 0] (\n        interpolation = "vertex"\n    )\n'
    normals = f"    normal3f[] normals = {vectors([[0, 1, 0]] * 4)}\n"
    turned = spline("xformOp:rotateY", {1: 0, 2: 60}) + TURNED
    with opened(layer(tmp_path / "a.usda", mesh(bound + normals + turned))) as clip:
        assert clip.not_read == {"skinning": ["/leaf"], "attribute": ["/leaf.normals"]}
    with opened(layer(tmp_path / "b.usda", instancer("many", "/many/leaf", mesh(bound)))) as clip:
        assert clip.not_read == {"Skeleton of an instance": ["/many:leaf"]}


@pytest.mark.formats
def test_the_command_line_says_what_of_a_stage_is_not_read(tmp_path, capsys):
    points = {code: LEAF + [code, 0, 0] for code in range(1, 9)}
    ball = 'def Sphere "ball"\n{\n}\n'
    path = layer(tmp_path / "a.usda", mesh("", points), ball, startTimeCode=1, endTimeCode=4)
    assert main(["encode", str(path), str(tmp_path / "a.ath")]) == 0
    said = capsys.readouterr().err
    assert "keys outside of the stage's range time codes 5 to 8" in said and "Sphere /ball" in said


# ---- glTF ----

POINTER = "KHR_animation_pointer"


class Gltf:
    """A glTF file in the making: `json`, and the bytes of its accessors."""

    def __init__(self, **members):
        scene = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}]}
        self.json = scene | {"accessors": [], "bufferViews": [], "animations": []} | members
        self.data = b""

    def array(self, values):
        values = np.asarray(values, np.float32)
        values = values.reshape(len(values), -1)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": values.nbytes}
        self.data += values.tobytes()
        self.json["bufferViews"].append(view)
        kind = {"componentType": COMPONENTS[values.dtype.name], "type": TYPES[values.shape[1]], "count": len(values)}
        self.json["accessors"].append(kind | {"bufferView": len(self.json["bufferViews"]) - 1})
        return len(self.json["accessors"]) - 1

    def mesh(self, *targets, **members):
        """A mesh of the leaf with morph targets by their shifts, (4, 3) each."""
        primitive = {"attributes": {"POSITION": self.array(LEAF)}, "mode": 5}
        if targets:
            primitive["targets"] = [{"POSITION": self.array(target)} for target in targets]
        self.json.setdefault("meshes", []).append({"primitives": [primitive], "name": "leaf"} | members)

    def animation(self, name, channels):
        """channels: (pointer or (node, path), times, values, interpolation)."""
        made = {"name": name, "samplers": [], "channels": []}
        for place, times, values, interpolation in channels:
            sampler = {"input": self.array(times), "output": self.array(values), "interpolation": interpolation}
            made["samplers"].append(sampler)
            target = {"path": "pointer", "extensions": {POINTER: {"pointer": place}}}
            if isinstance(place, str):
                self.json["extensionsUsed"] = [POINTER]
            else:
                target = {"node": place[0], "path": place[1]}
            made["channels"].append({"sampler": len(made["samplers"]) - 1, "target": target})
        self.json["animations"].append(made)

    def save(self, path):
        kept = {key: value for key, value in self.json.items() if value}
        path.write_bytes(glb(kept | {"buffers": [{"byteLength": len(self.data)}]}, self.data))
        return path


TIMES = np.arange(31) / 30
SWAY = 0.5 + 0.5 * np.cos(2 * np.pi * TIMES)
BEND = TIMES**2
SHIFTS = np.array([LEAF[:, 2:] * [0.3, 0, 0], LEAF[:, 2:] ** 2 * [0, 0.1, 0]])


def bending(path, channels, nodes=({"mesh": 0, "name": "leaf"},), **mesh_members):
    made = Gltf(nodes=[dict(node) for node in nodes])
    made.json["scenes"][0]["nodes"] = list(range(len(nodes)))
    made.mesh(*SHIFTS, **mesh_members)
    made.animation("wind", channels)
    return made.save(path)


def bent(sway, bend):
    """(T, 4, 3) for the weights (T,) of both targets."""
    return LEAF + np.multiply.outer(sway, SHIFTS[0]) + np.multiply.outer(bend, SHIFTS[1])


def key(place, values, interpolation="LINEAR"):
    return place, TIMES[: len(values)], values, interpolation


MOVE = np.stack([TIMES, 0 * TIMES, -TIMES], axis=1)
BOTH = np.stack([SWAY, BEND], axis=1).ravel()
POINTED = {
    "a weight and the node": (
        [key("/nodes/0/weights/1", BEND), key((0, "translation"), MOVE)],
        bent(0.25 + 0 * TIMES, BEND) + MOVE[:, None],
    ),
    "each weight": ([key("/nodes/0/weights/0", SWAY), key("/nodes/0/weights/1", BEND)], bent(SWAY, BEND)),
    "the weights of the mesh": ([key("/meshes/0/weights", BOTH)], bent(SWAY, BEND)),
    "a weight of the mesh": ([key("/meshes/0/weights/0", SWAY)], bent(SWAY, 0 * TIMES)),
}


@pytest.mark.parametrize("channels, expected", POINTED.values(), ids=POINTED)
def test_pointers_to_weights_of_nodes_and_meshes_are_played(tmp_path, channels, expected):
    path = bending(tmp_path / "a.glb", channels, weights=[0.25, 0])
    with athcodec.read(path) as clip:
        assert not clip.not_read and clip.metadata["animations"] == ["wind"]
        assert clip.block(0, 31).shape == expected.shape and np.abs(clip.block(0, 31) - expected).max() < 1e-6


def test_a_glb_keeps_the_motion_of_pointers_when_a_motion_is_put_into_it(tmp_path):
    channels, expected = POINTED["a weight and the node"]
    source, out = bending(tmp_path / "a.glb", channels, weights=[0.25, 0]), tmp_path / "b.glb"
    assert main(["encode", str(source), "--into", str(out), "--max-error", "1e-4", "--effort", "fast"]) == 0
    with athcodec.open(out) as motion:
        assert np.abs(motion[:] - expected).max() <= 1e-4
    gltf = apart(out.read_bytes())[0]
    assert "animations" not in gltf and gltf["extensionsUsed"] == ["ATH_motion"]


def test_what_animations_of_a_glb_address_besides_is_named(tmp_path):
    made = Gltf(nodes=[{"mesh": 0, "name": "leaf"}, {"name": "away"}], materials=[{"name": "bark"}])
    made.mesh(*SHIFTS)
    colour = "/materials/0/pbrMetallicRoughness/baseColorFactor"
    grey, unknown = (colour, [0, 1], np.ones((2, 4)), "LINEAR"), "/nodes/0/extensions/EXT_swing/angle"
    away = ((1, "translation"), [0, 1], np.zeros((2, 3)), "LINEAR")
    made.animation("wind", [key("/nodes/0/weights", BOTH), grey, (unknown, [0, 1], [0, 1], "LINEAR"), away])
    made.animation("colours", [grey])
    made.animation("gale", [key("/nodes/0/weights/0", BEND)])
    path = made.save(tmp_path / "a.glb")
    with pytest.warns(SourceWarning, match=f"animation channel wind: {unknown}$"):
        clip = athcodec.read(path)
    with clip:
        assert clip.metadata["animations"] == ["wind"] and clip.metadata["other_animations"] == ["gale"]
        assert clip.not_read == {
            "Material": ["bark"],
            "animated property": [f"wind: {colour}", "wind: /nodes/1/translation", f"colours: {colour}"],
            "animation channel": [f"wind: {unknown}"],
            "animation": ["gale"],
        }
    with pytest.warns(SourceWarning), athcodec.read(path, takes="all") as clip:
        assert [each.name for each in clip.clip_ranges] == ["wind", "gale"] and "animation" not in clip.not_read
    with pytest.raises(ClipError, match=r"got colours, which moves no node of the scene, expected one of wind, gale"):
        athcodec.read(path, takes=["colours"])


def test_meshes_scenes_extensions_and_extras_that_are_not_read_are_named(tmp_path):
    made = Gltf(nodes=[{"mesh": 0, "extras": {"age": 3}}, {"mesh": 2}], scenes=[{"nodes": [0]}, {"nodes": [1]}])
    made.mesh()
    made.mesh(name="spare")
    made.mesh(name="other", extensions={"EXT_moss": {}})
    made.json["meshes"][0]["primitives"][0]["attributes"] |= {
        "NORMAL": made.array([[0, 1, 0]] * 4),
        "JOINTS_0": made.array(np.zeros((4, 4))),
    }
    made.json["extensionsUsed"] = ["KHR_xmp_json_ld", "KHR_texture_transform", "KHR_node_visibility"]
    made.json["extensionsRequired"] = ["KHR_node_visibility"]
    with pytest.warns(SourceWarning, match="not read: scene scene 1; mesh that no node of the scene has spare, other$"):
        clip = athcodec.read(made.save(tmp_path / "a.glb"))
    with clip:
        assert clip.metadata["part_names"] == ["leaf"] and "normals" in clip.attributes
        assert clip.not_read == {
            "scene": ["scene 1"],
            "mesh that no node of the scene has": ["spare", "other"],
            "attribute": ["leaf.JOINTS_0"],
            "extension": ["KHR_xmp_json_ld", "EXT_moss"],
            "extras": ["node 0"],
        }
    made.json["scene"] = 1
    made.json["nodes"][1] = {"name": "bare"}
    with pytest.raises(
        ClipError, match="meshes: got none in the scene, .*; not read: scene scene 0; mesh that no node"
    ):
        athcodec.read(made.save(tmp_path / "b.glb"))


@pytest.mark.formats
def test_weights_of_a_node_count_more_than_those_of_its_mesh_and_single_ones_more_than_all(tmp_path):
    zero, one = np.zeros(31), np.ones(31)
    leaf, own = {"mesh": 0, "name": "leaf"}, {"mesh": 0, "name": "own", "weights": [1, 0]}
    channels = [key("/nodes/0/weights/1", zero), key("/meshes/0/weights/0", one), key("/meshes/0/weights", BOTH)]
    path = bending(tmp_path / "a.glb", channels, [leaf, own, leaf])
    with athcodec.read(path) as clip:
        found = clip.block(0, 31)
    for place, expected in enumerate((bent(one, zero), bent(one, zero), bent(one, BEND))):
        assert np.abs(found[:, 4 * place : 4 * place + 4] - expected).max() < 1e-6
    slopes = np.zeros((2, 3, 1))
    slopes[:, 1, 0] = 0, 1
    path = bending(tmp_path / "b.glb", [("/nodes/0/weights/0", [0, 1], slopes.reshape(-1, 1), "CUBICSPLINE")])
    with athcodec.read(path, fps=30) as clip:  # The cubic that is level at both keys.
        assert np.abs(clip.block(0, 31) - bent(3 * TIMES**2 - 2 * TIMES**3, zero)).max() < 1e-6
    for pointer, message in (
        ("/nodes/0/weights/2", "weight 2 animated, expected those of its 2 morph targets"),
        ("/meshes/3/weights", "got entry 3 of meshes, expected one below 1"),
    ):
        with pytest.raises(ClipError, match=message):
            with athcodec.read(bending(tmp_path / "c.glb", [key(pointer, SWAY)])) as clip:
                clip.block(0, 1)


@pytest.mark.formats
def test_pointers_that_move_no_vertices_stay_in_a_glb_that_a_motion_is_put_into(tmp_path, capsys):
    made = Gltf(nodes=[{"mesh": 0, "name": "leaf"}], materials=[{}])
    made.mesh(*SHIFTS)
    colour = ("/materials/0/alphaCutoff", [0, 1], [0, 1], "LINEAR")
    shown = ("/nodes/0/extensions/KHR_node_visibility/visible", [0, 0.5], [1, 0], "STEP")
    made.animation("wind", [key("/meshes/0/weights", BOTH), colour, shown, key((0, "translation"), MOVE / 99)])
    made.animation("colours", [colour])
    out = tmp_path / "b.glb"
    arguments = ["--into", str(out), "--max-error", "1e-4", "--effort", "fast"]
    assert main(["encode", str(made.save(tmp_path / "a.glb")), *arguments]) == 0
    assert "not written: " in (said := capsys.readouterr().err) and "visibility in time leaf" in said
    gltf = apart(out.read_bytes())[0]
    left = [
        channel["target"]["extensions"][POINTER]["pointer"] if "extensions" in channel["target"] else channel["target"]
        for animation in gltf["animations"]
        for channel in animation["channels"]
    ]
    assert left.count(colour[0]) == 2 and not any("weights" in str(each) for each in left)
    assert POINTER in gltf["extensionsUsed"]
    with athcodec.open(out) as motion:
        assert np.abs(motion[:] - (bent(SWAY, BEND) + MOVE[:, None] / 99)).max() <= 1e-4


def test_the_rate_that_a_warning_of_missed_keys_advises_can_be_followed(tmp_path):
    """Keys of two close times, of times on another rate, and of times that no rate has."""

    def moved(times):
        values = np.arange(3 * len(times)).reshape(-1, 3)
        return bending(tmp_path / "a.glb", [((0, "translation"), times, values, "LINEAR")])

    for times in ([0, 0.5, 0.503, 1], [0, 0.013, 0.5, 1]):
        with pytest.warns(GuessWarning) as said:
            athcodec.read(moved(times)).close()
        advised = re.search(r"--fps (\d+(?:\.\d+)?) has a frame at each", str(said[0].message))
        with warnings.catch_warnings(), athcodec.read(moved(times), fps=float(advised[1])) as clip:
            assert 2 < clip.frame_count < 2000
    with pytest.warns(GuessWarning, match="they lie on no rate up to 1000 per second, so resample them"):
        athcodec.read(moved([0, 0.5137, 0.5138, 1])).close()


# ---- Alembic ----


def filled(kind, values):
    array = kind(len(values))
    np.asarray(memoryview(array))[...] = values
    return array


def archive_of(path, fill):
    """An archive that `fill(top, sampling)` adds objects to; sampling(times) is a time sampling of these seconds."""
    from alembic3d import Abc

    archive = Abc.OArchive(str(path))
    fill(archive.getTop(), lambda times: Abc.Argument(archive.addTimeSampling(sampling_of(times))))
    archive = None
    gc.collect()  # An archive is complete when nothing refers to it.
    return path


def sampling_of(times):
    from alembic3d import AbcCoreAbstract

    steps = np.diff(times)
    if len(steps) and np.ptp(steps) < 1e-9:
        return AbcCoreAbstract.TimeSampling(float(steps[0]), float(times[0]))
    kind = AbcCoreAbstract.TimeSamplingType(AbcCoreAbstract.AcyclicFlag.kAcyclic)
    uneven = AbcCoreAbstract.TimeVector()
    for time in times:
        uneven.append(float(time))
    return AbcCoreAbstract.TimeSampling(kind, uneven)


def add_leaf(parent, name, sampling, times, moved):
    """A mesh of the leaf at moved(time) (4, 3) for each sample."""
    import imath
    from alembic3d import AbcGeom

    shape = AbcGeom.OPolyMesh(parent, name, sampling(times))
    corners, counts = filled(imath.IntArray, [3, 2, 1, 0]), filled(imath.IntArray, [4])
    for time in times:
        points = filled(imath.V3fArray, moved(time))
        shape.getSchema().set(AbcGeom.OPolyMeshSchemaSample(points, corners, counts))
    return shape


def test_alembic_objects_of_several_time_samplings_are_read_at_all_of_their_times(tmp_path):
    uneven, even = [0.0, 0.1, 0.25, 1.0], [0.25, 0.5, 0.75]

    def fill(top, sampling):
        add_leaf(top, "a", sampling, uneven, lambda time: LEAF + [time, 0, 0])
        add_leaf(top, "b", sampling, even, lambda time: LEAF + [0, 2 * time, 0])

    clip = opened(archive_of(tmp_path / "a.abc", fill))
    times = np.array([0, 0.1, 0.25, 0.5, 0.75, 1.0])
    assert np.allclose(clip.time, times) and not clip.not_read
    held = np.clip(times, 0.25, 0.75)
    expected = [LEAF + np.multiply.outer(times, [[1, 0, 0]]), LEAF + np.multiply.outer(2 * held, [[0, 1, 0]])]
    assert np.abs(frames_of(clip) - np.concatenate(expected, axis=1)).max() < 1e-6


def test_what_an_archive_holds_besides_is_named_and_where_nothing_can_be_read_too(tmp_path):
    from alembic3d import Abc, AbcGeom

    def fill(top, sampling):
        place = AbcGeom.OXform(top, "place", sampling([0, 1]))
        place.getSchema().set(AbcGeom.XformSample())
        Abc.OFloatProperty(place.getSchema().getUserProperties(), "wind").setValue(3.0)
        Abc.OFloatProperty(Abc.OObject(top, "note").getProperties(), "height").setValue(2.0)
        AbcGeom.ONuPatch(place, "petal")
        AbcGeom.OLight(top, "sun", sampling([0, 1]))
        return place

    with pytest.raises(ClipError, match="got none with points.*; not read: attribute /place.wind, /note.height"):
        opened(archive_of(tmp_path / "a.abc", fill))

    def fill_more(top, sampling):
        leaf = add_leaf(fill(top, sampling), "leaf", sampling, [0, 1], lambda time: LEAF + time)
        Abc.OFloatProperty(leaf.getProperties(), "age").setValue(1.0)

    with opened(archive_of(tmp_path / "b.abc", fill_more)) as clip:
        assert clip.not_read == {
            "attribute": ["/place.wind", "/note.height", "/place/leaf.age"],
            "NuPatch": ["/place/petal"],
            "Light": ["/sun"],
        }
    with pytest.raises(ClipError, match="named like bark, .*, or /place/leaf; not read"):
        opened(tmp_path / "b.abc", only=["bark"])


@pytest.mark.formats
def test_the_basis_of_cubic_curves_goes_through_alembic(tmp_path):
    import imath
    from alembic3d import AbcGeom

    def fill(top, sampling):
        curve = AbcGeom.OCurves(top, "stem", sampling([0]))
        held = filled(imath.V3fArray, LEAF), filled(imath.IntArray, [4])
        kinds = AbcGeom.CurveType.kCubic, AbcGeom.CurvePeriodicity.kNonPeriodic
        basis = AbcGeom.BasisType.kCatmullromBasis
        sample = AbcGeom.OCurvesSchemaSample(*held, iType=kinds[0], iWrap=kinds[1], iBasis=basis)
        curve.getSchema().set(sample)

    with opened(archive_of(tmp_path / "a.abc", fill)) as clip:
        assert clip.metadata["part_usd"] == [{"type": "cubic", "basis": "catmullRom"}]
        athcodec.write(clip, tmp_path / "b.abc")
    with opened(tmp_path / "b.abc") as again:
        assert again.metadata["part_usd"] == [{"type": "cubic", "basis": "catmullRom"}]


@pytest.mark.formats
def test_every_schema_of_alembic_is_read_or_named(tmp_path):
    from alembic3d import AbcGeom

    kinds = [
        name[1:]
        for name in dir(AbcGeom)
        if re.fullmatch(r"O(?!GeomBase|Schema_)\w+", name) and f"{name}Schema" in dir(AbcGeom)
    ]
    assert {"PolyMesh", "SubD", "Curves", "Points", "NuPatch", "Xform"} <= set(kinds)

    def fill(top, sampling):
        add_leaf(top, "leaf", sampling, [0, 1], lambda time: LEAF + time)
        for kind in [*kinds, "Camera"]:
            getattr(AbcGeom, f"O{kind}")(top, f"_{kind}")

    with opened(archive_of(tmp_path / "a.abc", fill)) as clip:
        named = {name for names in clip.not_read.values() for name in names}
    # Face sets are part of a mesh, and transforms of what hangs on them.
    assert {f"/_{kind}" for kind in [*kinds, "Camera"]} - named == {"/_Xform", "/_FaceSet"}


# ---- the page ----


@pytest.mark.formats
def test_the_page_of_what_is_read_names_all_that_the_formats_have():
    from alembic3d import AbcGeom
    from pxr import Tf, Usd

    page = (Path(__file__).resolve().parent.parent / "docs" / "what-is-read.md").read_text()
    sections = dict(section.split("\n", 1) for section in page.split("\n## ")[1:])
    kinds = Tf.Type.FindByName("UsdTyped").GetAllDerivedTypes()
    of_shapes = [kind for kind in kinds if kind.typeName.startswith(("UsdGeom", "UsdSkel", "UsdVol"))]
    usd = set(map(Usd.SchemaRegistry.GetConcreteSchemaTypeName, of_shapes))
    alembic = {name[1:] for name in dir(AbcGeom) if f"I{name[1:]}Schema" in dir(AbcGeom) and name[0] == "O"}
    for section, names in (("USD", usd - {""}), ("Alembic", alembic)):
        assert not {name for name in names if f"`{name}`" not in sections[section]}
