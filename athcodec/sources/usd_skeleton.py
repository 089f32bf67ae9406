"""Reads skeletons of UsdSkel: skinning, blend shapes, and the joints of a clip."""

from __future__ import annotations

import numpy as np
from pxr import Sdf, Usd, UsdSkel, Vt

from athcodec.errors import ClipError
from athcodec.motion.clip import Skin
from athcodec.sources.usd_values import PrimObject, lineage
from athcodec.untyped import UsdObject


class Skeleton:
    """A skeleton and one mesh that it moves."""

    def __init__(self, query: UsdSkel.SkeletonQuery, target: UsdSkel.SkinningQuery):
        """Prepare a mesh's skinning and blend shapes. `query` is of the skeleton, `target` of the mesh that it
        moves."""
        self.query, self.target = query, target
        self.animation = query.GetAnimQuery()
        self.skins = target.HasJointInfluences()
        self._shapes: UsdObject = None
        self._mapper: UsdObject = None
        if target.HasBlendShapes() and self.animation:
            self._shapes = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(target.GetPrim()))
            self._mapper = target.GetBlendShapeMapper()
            self._indices = self._shapes.ComputeBlendShapePointIndices()
            self._offsets = self._shapes.ComputeSubShapePointOffsets()

    def deform(self, points: Vt.Vec3fArray, code: float) -> Vt.Vec3fArray:
        """Return a mesh's points as blend shapes and joints move them at a time code. They are in the skeleton's space
        if joints move them, else in the mesh's own. Raises ClipError."""
        points = Vt.Vec3fArray(points)
        if self._shapes is not None:
            self._blend(points, code)
        if self.skins:
            joints = self.query.ComputeSkinningTransforms(code)
            if not joints or not self.target.ComputeSkinnedPoints(joints, points, code):
                raise ClipError(f"{self.target.GetPrim().GetPath()}: its skeleton cannot be evaluated at {code:g}")
        return points

    def _blend(self, points: Vt.Vec3fArray, code: float) -> None:
        """Move the points in place by the blend shapes' weights at a time code. Raises ClipError if they cannot be
        evaluated."""
        weights = self.animation.ComputeBlendShapeWeights(code)
        if weights is None:
            return
        if self._mapper is not None:
            weights = self._mapper.Remap(weights, elementSize=1)
        sub_shapes = self._shapes.ComputeSubShapeWeights(weights)
        if sub_shapes is None or not self._shapes.ComputeDeformedPoints(
            *sub_shapes, self._indices, self._offsets, points
        ):
            raise ClipError(f"{self.target.GetPrim().GetPath()}: its blend shapes cannot be evaluated at {code:g}")

    @property
    def space(self) -> Usd.Prim:
        return self.query.GetPrim() if self.skins else self.target.GetPrim()

    def mirrors(self, count: int, code: float) -> bool:
        """Return whether skinning turns the mesh inside out at a time code, judged by the joint that moves most of its
        `count` vertices."""
        joints = self.largest(count)
        joints = joints[joints >= 0]
        if not len(joints):
            return False
        matrix = np.array(self.query.ComputeSkinningTransforms(code)[int(np.bincount(joints).argmax())])
        bind = np.array(self.target.GetGeomBindTransform())
        return bool(np.linalg.det(bind[:3, :3]) * np.linalg.det(matrix[:3, :3]) < 0)

    def largest(self, count: int) -> np.ndarray:
        """Return for each of the mesh's `count` vertices the number of the skeleton's joint with the largest weight
        (count,), -1 for a vertex without any."""
        influences = self.target.ComputeVaryingJointInfluences(count) if self.skins else None
        if not influences or count == 0:
            return np.full(count, -1, np.int32)
        joints, weights = (np.array(values).reshape(count, -1) for values in influences)
        rows = np.arange(count), weights.argmax(axis=1)
        chosen = joints[rows]
        order = self.target.GetJointOrder()
        if order:
            places = {str(name): i for i, name in enumerate(self.query.GetJointOrder())}
            place = np.array([places.get(str(name), -1) for name in order])
            chosen = place[np.clip(chosen, 0, len(place) - 1)]
        return np.where(weights[rows] > 0, chosen, -1).astype(np.int32)


def bind_skeletons(
    stage: Usd.Stage, objects: list[PrimObject], not_read: dict[str, list[str]]
) -> list[UsdSkel.SkeletonQuery]:
    """Store in each object the skeleton that moves it, and return the skeletons of the stage. Animations that move no
    skeleton, and missing ones, are added to `not_read`."""
    by_path = {obj.prim.GetPath(): obj for obj in objects}
    predicate = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
    queries, animations = [], {}
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), predicate):
        if prim.IsA(UsdSkel.Animation):
            animations[prim.GetPath()] = str(prim.GetPath())
        if not prim.IsA(UsdSkel.Root):
            continue
        root, cache = UsdSkel.Root(prim), UsdSkel.Cache()
        cache.Populate(root, predicate)
        for binding in cache.ComputeSkelBindings(root, predicate):
            query = cache.GetSkelQuery(binding.GetSkeleton())
            queries.append((cache, query))  # the cache owns what the query refers to
            for target in binding.GetSkinningTargets():
                obj = by_path.get(target.GetPrim().GetPath())
                moves = query and (target.HasJointInfluences() or target.HasBlendShapes())
                if obj is not None and moves and obj.instances is None:
                    obj.skeleton = Skeleton(query, target)
    for _, query in queries:
        if query.GetAnimQuery():
            animations.pop(query.GetAnimQuery().GetPrim().GetPath(), None)
        elif query and (source := _missing_animation(query.GetPrim())):
            not_read.setdefault("missing", []).append(source)
    if animations:
        not_read["SkelAnimation"] = list(animations.values())
    for obj in objects:
        if obj.skeleton is None and _is_bound(obj.prim):
            kind = "Skeleton of an instance" if obj.instances is not None else "skinning"
            not_read.setdefault(kind, []).append(obj.path)
    return queries


def _is_bound(prim: Usd.Prim) -> bool:
    """Return whether a prim says that joints or blend shapes move it."""
    binding = UsdSkel.BindingAPI(prim)
    return binding.GetJointIndicesAttr().HasAuthoredValue() or binding.GetBlendShapesAttr().HasAuthoredValue()


def _missing_animation(skeleton: Usd.Prim) -> str | None:
    """Return the animation that a skeleton names, or a prim above it does, and that is not there; None where none is
    named."""
    for prim in lineage(skeleton):
        relationship = UsdSkel.BindingAPI(prim).GetAnimationSourceRel()
        if relationship and relationship.HasAuthoredTargets():
            return f"animation {', '.join(map(str, relationship.GetTargets()))} of {skeleton.GetPath()}"
    return None


def skin_of(objects: list[PrimObject], queries: list[tuple[UsdObject, UsdSkel.SkeletonQuery]]) -> Skin | None:
    """Return the joints of all skeletons, numbered one skeleton after the other, with the strongest joint of each
    vertex of the objects. Return None if no joint moves any vertex. `queries` has each skeleton beside the cache that
    owns it."""
    parents: list[np.ndarray] = []
    names: list[str] = []
    first: dict[Sdf.Path, int] = {}
    for _, query in queries:
        path = query.GetPrim().GetPath()
        if path in first:
            continue
        first[path] = sum(map(len, parents))
        joints_of_object = np.array(query.GetTopology().GetParentIndices(), np.int32)
        parents.append(np.where(joints_of_object < 0, -1, joints_of_object + first[path]))
        names += [str(name) for name in query.GetJointOrder()]
    if not names or not any(obj.skeleton is not None and obj.skeleton.skins for obj in objects):
        return None
    joints = np.full(sum(obj.count for obj in objects), -1, np.int32)
    for obj in objects:
        if obj.skeleton is not None:
            joints_of_object = obj.skeleton.largest(obj.count)
            offset = first[obj.skeleton.query.GetPrim().GetPath()]
            joints[obj.first : obj.first + obj.count] = np.where(joints_of_object < 0, -1, joints_of_object + offset)
    return Skin(np.concatenate(parents).astype(np.int32), joints, names)
