"""A motion as UsdSkel: what athcodec/exporters/rig.py finds, as a Skeleton, a SkelAnimation for each clip, and weights.

The skeleton plays the first clip; others are there by their names, for programs that choose among them. Meshes stand in
the rest pose.
"""

from __future__ import annotations

import numpy as np
from pxr import Gf, Tf, Usd, UsdSkel, Vt

from athcodec.exporters.gltf_joints import Joints
from athcodec.exporters.scene_objects import SceneObject, distinct
from athcodec.motion.protocol import Motion

SKELETON = "skeleton"


def write_rig(
    stage: Usd.Stage, place: str, motion: Motion, joints: Joints, objects: list[SceneObject], codes: np.ndarray
) -> None:
    """Add a skeleton and its animations below the prim at `place`, and bind the objects' targets to it. `codes` (T,)
    has the time codes of all frames, which begin anew with each clip.
    """
    skeleton = UsdSkel.Skeleton.Define(stage, f"{place}/{SKELETON}")
    paths = _paths(joints)
    skeleton.CreateJointsAttr(paths)
    skeleton.CreateBindTransformsAttr([Gf.Matrix4d(np.linalg.inv(bind).T) for bind in joints.bind.astype(np.float64)])
    skeleton.CreateRestTransformsAttr([_shifted(place) for place in joints.rest[0].tolist()])
    names = distinct(Tf.MakeValidIdentifier(clip.name or "motion") for clip in motion.clip_ranges) or ["motion"]
    for name, (start, stop) in zip(names, motion.clip_range_frames):
        animation = UsdSkel.Animation.Define(stage, f"{place}/{SKELETON}/{name}")
        _animate(animation, paths, [pose[start:stop] for pose in joints.poses], codes[start:stop])
    binding = UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    binding.CreateAnimationSourceRel().SetTargets([f"{place}/{SKELETON}/{names[0]}"])
    for obj in objects:
        _bind(obj, joints, f"{place}/{SKELETON}")


def _paths(joints: Joints) -> list[str]:
    paths: list[str] = []
    assert joints.parent is not None  # A rig has parents and weights.
    for name, above in zip(joints.names, joints.parent.tolist()):
        paths.append(name if above < 0 else f"{paths[above]}/{name}")
    return paths


def _shifted(place: list[float]) -> Gf.Matrix4d:
    return Gf.Matrix4d().SetTranslate(Gf.Vec3d(*place))


def _animate(animation: UsdSkel.Animation, paths: list[str], poses: list[np.ndarray], codes: np.ndarray) -> None:
    """Write samples of translations and rotations; the scales are 1 throughout."""
    animation.CreateJointsAttr(paths)
    animation.CreateScalesAttr(Vt.Vec3hArray(len(paths), Gf.Vec3h(1)))
    places, turns = animation.CreateTranslationsAttr(), animation.CreateRotationsAttr()
    for code, place, turn in zip(codes.tolist(), poses[0], poses[1]):
        places.Set(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(place)), code)
        turns.Set(Vt.QuatfArray.FromNumpy(np.ascontiguousarray(turn)), code)


def _bind(obj: SceneObject, joints: Joints, skeleton: str) -> None:
    """Bind an object to the skeleton at the path `skeleton`, with the joints and weights of its vertices."""
    binding = UsdSkel.BindingAPI.Apply(obj.target.GetPrim())
    assert joints.weights is not None  # A rig has parents and weights.
    bones, weights = joints.vertex_joint[obj.vertices], joints.weights[obj.vertices]
    width = bones.shape[1]
    binding.CreateSkeletonRel().SetTargets([skeleton])
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1))
    binding.CreateJointIndicesPrimvar(False, width).Set(
        Vt.IntArray.FromNumpy(np.where(weights > 0, bones, 0).astype(np.int32).reshape(-1))
    )
    binding.CreateJointWeightsPrimvar(False, width).Set(Vt.FloatArray.FromNumpy(weights.reshape(-1)))
