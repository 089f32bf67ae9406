"""A rig is what engines make of it: the libraries of the formats move vertices to where the motion has them."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Usd, UsdSkel
from test_usd import add_grid, add_leaves, complaints, new_stage

import athcodec
from athcodec import ClipView, cli
from athcodec.errors import ClipError
from athcodec.exporters.rig import fit_rig


@pytest.mark.parametrize("name", ["a.usda", "a.usdc", "a.glb"])
def test_a_rig_is_as_far_off_as_it_says(sample_ath, tmp_path, name):
    with athcodec.open(sample_ath) as decoder:
        written = athcodec.write(ClipView(decoder), tmp_path / name, rig=200)
        positions = decoder.positions(slice(0, decoder.frame_count)).astype(np.float64)
        diagonal = np.linalg.norm(np.ptp(decoder.rest, axis=0))
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


def test_joints_are_a_tree_over_the_branches_and_weights_add_up_to_one(sample_ath):
    with athcodec.open(sample_ath) as decoder:
        rig, branch, parents = fit_rig(ClipView(decoder), 256), decoder.vertex_branch, decoder.branch_parent
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
        assert np.linalg.norm(off, axis=2).max() < 0.05 * np.linalg.norm(np.ptp(decoder.rest, axis=0))
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
    stage = new_stage(tmp_path / "a.usda")
    add_grid(stage)
    add_leaves(stage)
    stage.Save()
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
