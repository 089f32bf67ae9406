"""A rig is what engines make of it: the libraries of the formats move vertices to where the motion has them."""

from __future__ import annotations

import json
import re
import warnings

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdSkel
from test_usd import complaints, leafy_stage

import athcodec
from athcodec import ClipView, cli
from athcodec.errors import ClipError, CoarseWarning
from athcodec.exporters.rig import fit_rig

pytestmark = pytest.mark.formats


@pytest.mark.parametrize("name", ["a.usda", "a.usdc", "a.glb"])
def test_a_rig_is_as_far_off_as_it_says(sample_ath, tmp_path, name):
    with athcodec.open(sample_ath) as decoder:
        written = athcodec.write(ClipView(decoder), tmp_path / name, rig=200)
        positions = decoder.positions(slice(0, decoder.frame_count)).astype(np.float64)
        diagonal = np.linalg.norm(np.ptp(decoder.file.rest, axis=0))
    with athcodec.read(tmp_path / name) as clip:
        off = np.linalg.norm(clip.block(0, clip.frame_count) - positions, axis=2).max()
    assert off == pytest.approx(written.facts["max_error"], abs=2e-6) and off < 2e-3 * diagonal
    assert 99 < written.facts["joints"] <= 201


def test_more_joints_are_closer(sample_ath, sample_clip, tmp_path):
    with athcodec.open(sample_ath) as decoder:
        rigs = [fit_rig(ClipView(decoder), most) for most in (20, 128, 256)]
    assert rigs[0].max_error > 3 * rigs[1].max_error > 6 * rigs[2].max_error
    assert athcodec.write(sample_clip, tmp_path / "a.glb", rig=20).facts["joints"] == 21
    assert [len(rig.bind) for rig in rigs] <= [21, 129, 257]


@pytest.mark.parametrize("name", ["a.usda", "a.glb"])
def test_a_rig_that_is_far_off_warns_and_more_joints_as_it_advises_end_that(sample_ath, tmp_path, name):
    with athcodec.open(sample_ath) as decoder:
        view = ClipView(decoder, frames=range(30))
        diagonal, joints = np.linalg.norm(np.ptp(decoder.file.rest, axis=0)), [4]
        while True:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always", CoarseWarning)
                written = athcodec.write(view, tmp_path / name, rig=joints[-1])
            with athcodec.read(tmp_path / name) as clip:
                off = np.linalg.norm(clip.block(0, 30) - view.positions[:], axis=2).max() / diagonal
            assert (off > 0.01) == bool(caught)
            if not caught:
                break
            said = str(caught[0].message)
            assert re.search(rf"off by {written.facts['max_error']:.3g} m, {100 * off:.2g} % of the diagonal", said)
            joints.append(int(re.search(r"such as --rig (\d+) \(rig=\1\)", said)[1]))
    assert joints in ([4, 16], [4, 16, 64])


def test_joints_are_a_tree_over_the_branches_and_weights_add_up_to_one(sample_ath):
    with athcodec.open(sample_ath) as decoder:
        rig, branch, parents = fit_rig(ClipView(decoder), 256), decoder.file.vertex_branch, decoder.file.branch_parent
    assert rig.names[0] == "root" and rig.parent[0] == -1
    assert (rig.parent[1:] < np.arange(1, len(rig.parent))).all() and (rig.parent[1:] >= 0).all()
    assert np.allclose(rig.weights.sum(axis=1), 1) and (rig.weights >= 0).all()
    strongest = rig.vertex_joint[np.arange(len(branch)), rig.weights.argmax(axis=1)]
    of = {int(joint): int(number) for joint, number in zip(strongest, branch)}
    for joint, number in of.items():
        above, ancestors = of.get(int(rig.parent[joint]), number), [number]
        while ancestors[-1] >= 0:
            ancestors.append(int(parents[ancestors[-1]]))
        assert above in ancestors


def test_a_stage_has_the_root_skeleton_and_animations_that_usd_skel_asks_for(several_ath, tmp_path):
    path, names = several_ath
    assert cli.main(["decode", str(path), str(tmp_path / "a.usda"), "--rig", "40"]) == 0
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    assert stage.GetDefaultPrim().IsA(UsdSkel.Root)
    skeleton = UsdSkel.Skeleton(stage.GetPrimAtPath("/clip/skeleton"))
    valid, reason = UsdSkel.Topology(skeleton.GetJointsAttr().Get()).Validate()
    assert valid, reason
    assert [prim.GetName() for prim in skeleton.GetPrim().GetChildren()] == names
    with athcodec.open(path) as decoder, athcodec.read(tmp_path / "a.usda") as clip:
        first = decoder.play(names[0])
        off = clip.block(0, first.frame_count) - first.positions(slice(0, first.frame_count))
        assert np.linalg.norm(off, axis=2).max() < 0.05 * np.linalg.norm(np.ptp(decoder.file.rest, axis=0))
        assert clip.not_read == {"SkelAnimation": [f"/clip/skeleton/{name}" for name in names[1:]]}


@pytest.fixture
def several_ath(sample_clip, tmp_path):
    """Two clips of the sample in one file, and their names."""
    names = ["calm", "storm"]
    parts = [
        sample_clip.replace(positions=sample_clip.positions[a:b], time=sample_clip.time[a:b])
        for a, b in ((0, 40), (40, 70))
    ]
    athcodec.encode(athcodec.join(dict(zip(names, parts))), tmp_path / "several.ath", rel_error=1e-3, effort="fast")
    return tmp_path / "several.ath", names


def test_leaves_of_an_instancer_are_joints_each_and_validators_have_nothing_to_say(tmp_path):
    leafy_stage(tmp_path / "a.usda")
    with athcodec.read(tmp_path / "a.usda") as clip:
        written = athcodec.write(clip, tmp_path / "b.usda", rig=20)
        assert written.facts["joints"] >= 7 and written.facts["max_error"] < 0.1
    assert complaints(tmp_path / "b.usda") == []


def test_rigs_that_cannot_be_are_refused(sample_ath, tmp_path):
    with athcodec.open(sample_ath) as decoder:
        with pytest.raises(ClipError, match="rig: got alembic, expected one of usd, gltf"):
            athcodec.write(ClipView(decoder), tmp_path / "a.abc", rig=10)
        with pytest.raises(ValueError, match="rig: got 0"):
            athcodec.write(ClipView(decoder), tmp_path / "a.usda", rig=0)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", ["usda", "usdc"])
def test_an_assembly_has_its_instances_on_joints_and_is_as_far_off_as_it_says(tmp_path, suffix):
    leafy_stage(tmp_path / "a.usda")
    with athcodec.read(tmp_path / "a.usda") as clip:
        written = athcodec.write(clip, tmp_path / f"b.{suffix}", rig=20, nanite=True)
        positions = clip.block(0, clip.frame_count).astype(np.float64)
    assert written.facts["instances"] == 5 and complaints(tmp_path / f"b.{suffix}") == []
    stage = Usd.Stage.Open(str(tmp_path / f"b.{suffix}"))
    root, off = stage.GetDefaultPrim(), 0.0
    assert root.GetTypeName() == "Xform" and _schemas(root) == ["NaniteAssemblyRootAPI"]
    assert root.GetAttribute("unreal:naniteAssembly:meshType").Get() == "skeletalMesh"
    [path] = root.GetRelationship("unreal:naniteAssembly:skeleton").GetTargets()
    skeleton = UsdSkel.Cache().GetSkelQuery(UsdSkel.Skeleton(stage.GetPrimAtPath(path)))
    names = [joint.rpartition("/")[2] for joint in skeleton.GetJointOrder()]
    instancers = [UsdGeom.PointInstancer(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.PointInstancer)]
    for frame in range(10):
        moved = np.array(skeleton.ComputeSkinningTransforms(101 + frame))
        shown = [_instances(stage, instancer, moved, names) for instancer in instancers]
        off = max(off, np.abs(np.concatenate(shown) - positions[frame, 12:]).max())
    assert off <= written.facts["max_error"] * (1 + 1e-5) + 2e-3  # of rotations in half precision
    wind = json.loads((tmp_path / "b.wind.json").read_text())
    assert [joint["JointName"] for joint in wind["Joints"]] == names
    assert {joint["SimulationGroupIndex"] for joint in wind["Joints"]} <= set(range(len(wind["SimulationGroups"])))


def _schemas(prim):
    """Those that USD itself does not know, too."""
    return prim.GetMetadata("apiSchemas").GetAppliedItems()


def _instances(stage, instancer, moved, names):
    """Vertices of instances that move as the joints that they are bound to, as Unreal's schema says."""
    prim, [target] = instancer.GetPrim(), instancer.GetPrototypesRel().GetTargets()
    assert _schemas(prim) == ["NaniteAssemblySkelBindingAPI"]
    assert stage.GetPrimAtPath(target).IsA(UsdSkel.Root)
    points = np.array(UsdGeom.Mesh(stage.GetPrimAtPath(f"{target}/mesh")).GetPointsAttr().Get())
    joints = prim.GetAttribute("primvars:unreal:naniteAssembly:bindJoints")
    assert joints.GetVariability() == Sdf.VariabilityUniform and UsdGeom.Primvar(joints).GetElementSize() == 1
    assert list(prim.GetAttribute("primvars:unreal:naniteAssembly:bindJointWeights").Get()) == [1] * len(joints.Get())
    found = []
    for joint, matrix in zip(joints.Get(), instancer.ComputeInstanceTransformsAtTime(0, 0), strict=True):
        whole = np.array(matrix) @ moved[names.index(joint)]
        found.append(points @ whole[:3, :3] + whole[3, :3])
    return np.concatenate(found)


def test_an_assembly_needs_a_base_a_rig_and_usd(tmp_path, sample_clip):
    leafy_stage(tmp_path / "a.usda", grid=False)
    with athcodec.read(tmp_path / "a.usda") as clip:
        with pytest.raises(ClipError, match="nanite: got no mesh beside the copies"):
            athcodec.write(clip, tmp_path / "b.usda", rig=20, nanite=True)
        with pytest.raises(ValueError, match="nanite: got no rig"):
            athcodec.write(clip, tmp_path / "b.usda", nanite=True)
        with pytest.raises(ClipError, match="nanite: got gltf"):
            athcodec.write(clip, tmp_path / "b.glb", rig=20, nanite=True)
    assert [path.name for path in tmp_path.iterdir()] == ["a.usda"]
