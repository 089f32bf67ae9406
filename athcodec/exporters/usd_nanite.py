"""A rig laid out as Unreal's Nanite Assemblies ask: a base that is skinned, and copies as instances on its joints.

Below the root, which has NaniteAssemblyRootAPI, are a SkelRoot with the skeleton and all objects that are no copies,
and a PointInstancer for each object that is. It has NaniteAssemblySkelBindingAPI, which names the joint that each
instance hangs on; its prototype is a SkelRoot of its own with a skeleton of one joint. Schemas and attributes are those
of the USDCore plugin of Unreal Engine 5.7. A copy moves as its joint does and does not bend; how far that is off is
measured.

Joints are grouped by the order of their branches for Unreal's plugin Dynamic Wind, whose JSON lies beside the stage.
Nothing of this was run in Unreal.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

from athcodec.errors import ClipError
from athcodec.exporters.copies import Copies, fit_copies
from athcodec.exporters.fitting import allowed_error, portions
from athcodec.exporters.gltf_joints import Joints
from athcodec.exporters.rig import hierarchy_to_rig
from athcodec.exporters.scene_objects import SceneObject
from athcodec.motion.clip import MotionClip
from athcodec.motion.protocol import Motion
from athcodec.motion.quaternions import rotation_matrices

ROOT_PRIM, BASE = "/clip", "/clip/base"
ROOT_SCHEMA, BINDING_SCHEMA = "NaniteAssemblyRootAPI", "NaniteAssemblySkelBindingAPI"
PART_JOINT = "root"


@dataclass(eq=False)
class Part:
    """Copies of one shape that hang on joints of the base: the number of the joint of each copy, (k,)."""

    copies: Copies
    joint: np.ndarray


def parts_of(motion: Motion, objects: list[SceneObject], joints: Joints) -> dict[int, Part]:
    """Return the objects that are copies of one shape at rest, as parts of the assembly, by their number. Raise
    ClipError if no mesh is left as its base.
    """
    rest = np.asarray(motion.rest)
    still = MotionClip(rest[None], np.zeros(1), rest=rest)
    parts = {
        number: Part(copies, _joint_of_copies(objects[number], joints))
        for number, copies in fit_copies(still, objects, allowed_error(motion)).items()
        if objects[number].kind == "mesh"
    }
    if not any(obj.kind == "mesh" for number, obj in enumerate(objects) if number not in parts):
        raise ClipError("nanite: got no mesh beside the copies, expected one as the base of the assembly")
    return parts


def _joint_of_copies(obj: SceneObject, joints: Joints) -> np.ndarray:
    """Return (k,) the joint that has the largest part in each copy."""
    weights = np.zeros((obj.copies, len(joints.bind)))
    copy = np.repeat(np.arange(obj.copies), obj.count // obj.copies)
    assert joints.weights is not None
    for bone, weight in zip(joints.vertex_joint[obj.vertices].T, joints.weights[obj.vertices].T):
        np.add.at(weights, (copy, bone), weight)
    return weights.argmax(axis=1)


def mark_root(root: Usd.Prim) -> None:
    """Make the prim an assembly of a skeletal mesh, whose skeleton is that of the base."""
    _apply(root, ROOT_SCHEMA)
    kind = root.CreateAttribute(
        "unreal:naniteAssembly:meshType", Sdf.ValueTypeNames.Token, False, Sdf.VariabilityUniform
    )
    kind.Set("skeletalMesh")
    root.CreateRelationship("unreal:naniteAssembly:skeleton", False).SetTargets([f"{BASE}/skeleton"])


def _apply(prim: Usd.Prim, schema: str) -> None:
    """Apply a schema by its name, because USD itself does not know it."""
    prim.AddAppliedSchema(schema)


def define_part(stage: Usd.Stage, place: str, name: str) -> str:
    """Define the instancer of a part and its prototype, without the mesh, at the path `place`. Return the path at which
    the prototype's mesh belongs.
    """
    UsdGeom.PointInstancer.Define(stage, place)
    prototype = f"{place}/Prototypes/{name}"
    UsdSkel.Root.Define(stage, prototype)
    skeleton = UsdSkel.Skeleton.Define(stage, f"{prototype}/skeleton")
    skeleton.CreateJointsAttr([PART_JOINT])
    skeleton.CreateBindTransformsAttr([Gf.Matrix4d(1)])
    skeleton.CreateRestTransformsAttr([Gf.Matrix4d(1)])
    return f"{prototype}/mesh"


def place_part(stage: Usd.Stage, place: str, name: str, obj: SceneObject, part: Part, joints: Joints) -> None:
    """Place the instances of a part at rest and name the joints that they hang on. `obj.target` is the mesh of the
    prototype.
    """
    instancer, prototype = UsdGeom.PointInstancer(stage.GetPrimAtPath(place)), f"{place}/Prototypes/{name}"
    copies, count = part.copies, len(part.joint)
    instancer.CreatePrototypesRel().SetTargets([prototype])
    instancer.CreateProtoIndicesAttr(Vt.IntArray(count, 0))
    instancer.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(copies.places[0])))
    instancer.CreateOrientationsAttr(Vt.QuathArray.FromNumpy(copies.turns[0].astype(np.float16)))
    if hasattr(instancer, "CreateOrientationsfAttr"):
        instancer.CreateOrientationsfAttr(Vt.QuatfArray.FromNumpy(np.ascontiguousarray(copies.turns[0])))
    instancer.CreateScalesAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(copies.scales[0])))
    _bind_instances(instancer.GetPrim(), [joints.names[joint] for joint in part.joint.tolist()])
    shape = np.ascontiguousarray(copies.shape)
    obj.target.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(shape))
    obj.target.GetExtentAttr().Set(Vt.Vec3fArray.FromNumpy(np.stack([shape.min(axis=0), shape.max(axis=0)])))
    binding = UsdSkel.BindingAPI.Apply(obj.target.GetPrim())
    binding.CreateSkeletonRel().SetTargets([f"{prototype}/skeleton"])
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1))
    binding.CreateJointIndicesPrimvar(False, 1).Set(Vt.IntArray(len(shape), 0))
    binding.CreateJointWeightsPrimvar(False, 1).Set(Vt.FloatArray(len(shape), 1.0))


def _bind_instances(prim: Usd.Prim, names: list[str]) -> None:
    """Bind each instance of a prim fully to one joint; `names` has the joint of each instance."""
    _apply(prim, BINDING_SCHEMA)
    for name, kind, values in (
        ("bindJoints", Sdf.ValueTypeNames.TokenArray, names),
        ("bindJointWeights", Sdf.ValueTypeNames.FloatArray, [1.0] * len(names)),
    ):
        attribute = prim.CreateAttribute(f"primvars:unreal:naniteAssembly:{name}", kind, False, Sdf.VariabilityUniform)
        attribute.Set(values)
        primvar = UsdGeom.Primvar(attribute)
        primvar.SetInterpolation(UsdGeom.Tokens.uniform)
        primvar.SetElementSize(1)


def largest_error(motion: Motion, objects: list[SceneObject], joints: Joints, parts: dict[int, Part]) -> float:
    """Return the largest distance of any vertex from the motion, when instances move as their joints do and the base as
    the rig does.
    """
    largest = joints.max_error
    for number, part in parts.items():
        turns = rotation_matrices(part.copies.turns[0].astype(np.float64)) * part.copies.scales[0][:, None, :]
        points = np.einsum("kij,mj->kmi", turns, part.copies.shape) + part.copies.places[0][:, None]
        for start, frames in portions(motion, motion.vertex_count):
            for frame, positions in enumerate(frames, start):
                world = _world(joints, frame)[part.joint]
                shown = np.einsum("kij,kmj->kmi", world[:, :3, :3], points) + world[:, None, :3, 3]
                off = shown.reshape(-1, 3) - positions[objects[number].vertices]
                largest = max(largest, float(np.sqrt((off**2).sum(axis=1).max())))
    return largest


def _world(joints: Joints, frame: int) -> np.ndarray:
    """Return the matrices (J, 4, 4) by which the joints move vertices from the rest pose to a frame."""
    matrices = np.tile(np.eye(4), (len(joints.bind), 1, 1))
    matrices[:, :3, :3] = rotation_matrices(joints.poses[1][frame].astype(np.float64))
    matrices[:, :3, 3] = joints.poses[0][frame]
    assert joints.parent is not None
    for joint, above in enumerate(joints.parent.tolist()):
        if above >= 0:
            matrices[joint] = matrices[above] @ matrices[joint]
    return matrices @ joints.bind.astype(np.float64)


def wind_of(motion: Motion, joints: Joints) -> str:
    """Return the JSON of Unreal's Dynamic Wind: the joints in groups by the generation of their branches, with the
    trunk's in group 0.
    """
    hierarchy = hierarchy_to_rig(motion)
    order = np.empty(len(joints.vertex_joint), np.int64)
    order[hierarchy.vertex_source] = np.repeat(hierarchy.branch_depth, hierarchy.stem_count)
    groups = np.full(len(joints.names), order.max(initial=0))
    assert joints.weights is not None
    strongest = joints.vertex_joint[np.arange(len(order)), joints.weights.argmax(axis=1)]
    np.minimum.at(groups, strongest, order)
    groups[0] = 0
    entries = [{"JointName": name, "SimulationGroupIndex": group} for name, group in zip(joints.names, groups.tolist())]
    influence = [
        {"bUseDualInfluence": False, "Influence": 1.0, "bIsTrunkGroup": group == 0}
        for group in range(int(groups.max()) + 1)
    ]
    wind = {"Joints": entries, "SimulationGroups": influence, "bIsGroundCover": False, "GustAttenuation": 0.0}
    return json.dumps(wind, indent=1) + "\n"
