"""Names what a USD stage holds besides the motion that is read of it (usd_stage.py), by its kind, for the clip's
`not_read`: what composition leaves out, layers that are not there, and properties of prims that nobody looks at.

Like usd_stage.py it is imported by the process of reader_main.py alone.
"""

from __future__ import annotations

import zipfile
from collections.abc import Collection, Iterator
from typing import Any

from pxr import Ar, Pcp, Sdf, Tf, Usd, UsdGeom, UsdSkel

from athcodec.sources.scene_objects import OWN, SCHEME

LISTED = 8  # Variants of a set that are named.
PLACES = ("positions", "orientations", "orientationsf", "scales", "protoIndices", "ids", "invisibleIds")
OBJECT_PROPERTIES = frozenset(  # Attributes of objects, or their namespaces, that are read or named one by one.
    (*PLACES, "points", "extent", "normals", "widths", "orientation", "doubleSided", SCHEME, "faceVertexCounts")
    + ("faceVertexIndices", "curveVertexCounts", "type", "basis", "wrap", "visibility", "purpose", "xformOpOrder")
    + ("creaseLengths", "creaseSharpnesses", "cornerSharpnesses", "primvars", "material", "skel", "subsetFamily", OWN)
)
RELATIONSHIPS = frozenset(("material", "skel", "prototypes"))  # Those that are followed.
PURPOSE_BINDINGS = ("material:binding:full", "material:binding:preview")


# ---- what composition leaves out ----


def left_out_of_stage(stage: Usd.Stage, prototypes: Collection[Sdf.Path]) -> dict[str, list[str]]:
    """Return the names of what the stage holds and nothing shows, by kind: inactive prims, `over`s without a prim,
    classes that no prim inherits, variants that are not selected, unused layers of a package, and custom layer data.
    `prototypes` are the prims that instancers show."""
    left_out: dict[str, list[str]] = {}
    classes = []

    def add(kind: str, prim: Usd.Prim, more: str = "") -> None:
        left_out.setdefault(kind, []).append(f"{prim.GetPath()}{more}")

    prims = iter(_PrimsOnce(stage))
    for prim in prims:
        if not prim.IsActive():
            add("inactive", prim)
        elif prim.IsAbstract():
            classes.append(prim)
        elif not prim.IsDefined() and not _is_below(prim.GetPath(), prototypes) and _says_anything(prim):
            add("over of no prim", prim)
        else:
            for text in _other_variants(prim):
                add("variant", prim, f" {text}")
            continue
        prims.prune()
    arc_paths = _sources_of_arcs(stage).union(prototypes) if classes else set()
    above = {prefix for path in arc_paths for prefix in path.GetPrefixes()}
    for prim in classes:
        is_taken = prim.GetPath() in above or _is_below(prim.GetPath(), arc_paths)
        if not is_taken and any(map(_has_shape, Usd.PrimRange(prim, Usd.PrimAllPrimsPredicate))):
            add("class that nothing inherits", prim)
    layers = _other_layers(stage.GetRootLayer())
    data = [f"customLayerData.{key}" for key in stage.GetRootLayer().customLayerData if key != OWN]
    return left_out | {kind: names for kind, names in (("layer", layers), ("metadata", data)) if names}


class _PrimsOnce:
    """Iterator of all prims of a stage, active or not, but each part of a native instance once; `prune` leaves out what
    is below the last one."""

    def __init__(self, stage: Usd.Stage):
        predicate = Usd.TraverseInstanceProxies(Usd.PrimAllPrimsPredicate)
        self._range = iter(Usd.PrimRange(stage.GetPseudoRoot(), predicate))
        self._seen: set[Usd.Prim] = set()

    def __iter__(self) -> _PrimsOnce:
        return self

    def __next__(self) -> Usd.Prim:
        """Return the next prim of the stage, leaving out prims of native instances that came before in another
        instance."""
        for prim in self._range:
            source = (prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim).GetPath()
            if source in self._seen:
                self._range.PruneChildren()
            elif not prim.IsPseudoRoot():
                self._seen.add(source)
                return prim
        raise StopIteration

    def prune(self) -> None:
        self._range.PruneChildren()


def _is_below(path: Sdf.Path, places: Collection[Sdf.Path]) -> bool:
    """Return whether a path is one of `places`, which is a set, or below one."""
    return any(prefix in places for prefix in path.GetPrefixes())


def _says_anything(prim: Usd.Prim) -> bool:
    return bool(prim.GetTypeName() or prim.GetAuthoredProperties())


def _has_shape(prim: Usd.Prim) -> bool:
    return prim.IsA(UsdGeom.PointInstancer) or prim.IsA(UsdGeom.Boundable) and not prim.IsA(UsdSkel.Skeleton)


def _other_variants(prim: Usd.Prim) -> Iterator[str]:
    """Yield one line of text for each variant set of a prim that has variants which are not selected."""
    if not prim.HasVariantSets():
        return
    for name in prim.GetVariantSets().GetNames():
        variants = prim.GetVariantSet(name)
        chosen = variants.GetVariantSelection()
        others = [other for other in variants.GetVariantNames() if other != chosen]
        if others:
            more = f" and {len(others) - LISTED} more" if len(others) > LISTED else ""
            yield f"{name}: {', '.join(others[:LISTED])}{more} ({chosen or 'none'} is read)"


def _sources_of_arcs(stage: Usd.Stage) -> set[Sdf.Path]:
    """Return the paths of prims in the stage that other prims inherit, specialize or reference."""
    paths = set()

    def follow(node: Pcp.NodeRef) -> None:
        paths.add(node.path)
        for child in node.children:
            follow(child)

    for prim in stage.TraverseAll():
        if prim.HasAuthoredInherits() or prim.HasAuthoredSpecializes() or prim.HasAuthoredReferences():
            for node in prim.GetPrimIndex().rootNode.children:
                follow(node)
    return paths


def _other_layers(root: Sdf.Layer) -> list[str]:
    """Return the names of layers in a .usdz package that are neither its first layer nor reached from it. For other
    files the list is empty."""
    if not zipfile.is_zipfile(root.realPath):
        return []
    with zipfile.ZipFile(root.realPath) as package:
        names = [name for name in package.namelist() if name.lower().endswith((".usd", ".usda", ".usdc"))]
    used, waiting = set(), [root]
    while waiting:
        layer = waiting.pop()
        for named in layer.GetCompositionAssetDependencies():
            place = layer.ComputeAbsolutePath(named)
            inside = Ar.SplitPackageRelativePathOuter(place)[1]
            if inside and inside not in used:
                used.add(inside)
                waiting += filter(None, [Sdf.Layer.FindOrOpen(place)])
    return [name for name in names[1:] if name not in used]


# ---- layers of value clips ----


def clip_layers(stage: Usd.Stage) -> tuple[list[str], list[str]]:
    """Return (files, missing): the files of the stage's value clips, which USD opens only when a value is asked for,
    and texts that name those that do not exist."""
    files, missing = [], []
    for prim in stage.TraverseAll():
        if not prim.HasAuthoredMetadata("clips"):
            continue
        api = Usd.ClipsAPI(prim)
        for name in api.GetClips():
            manifest = api.GetClipManifestAssetPath(name)
            for asset in (*api.ComputeClipAssetPaths(name), *([manifest] if manifest else ())):
                if asset.resolvedPath:
                    files.append(str(asset.resolvedPath))
                else:
                    missing.append(f"value clip @{asset.path}@ of {prim.GetPath()}")
    return list(dict.fromkeys(files)), list(dict.fromkeys(missing))


# ---- properties ----


def unread_properties(prim: Usd.Prim) -> list[str]:
    """Return the names of properties and metadata that are authored on a prim, differ from their fallback and are not
    read. Properties of one namespace are named by the namespace."""
    unread: dict[str, None] = {}
    order = UsdGeom.Xformable(prim).GetXformOpOrderAttr().Get() if prim.IsA(UsdGeom.Xformable) else None
    operations = {name.removeprefix("!invert!") for name in order or ()}
    for attribute in prim.GetAuthoredAttributes():
        name = attribute.GetName()
        space = name.partition(":")[0]
        if space == "xformOp":
            if name not in operations:
                unread[f"{name} (not in xformOpOrder)"] = None
        elif space not in OBJECT_PROPERTIES and _differs(prim, attribute):
            unread[space] = None
        if attribute.HasAuthoredConnections():
            unread[f"{name}.connect"] = None
    for relationship in prim.GetAuthoredRelationships():
        name, targets = relationship.GetName(), relationship.GetForwardedTargets()
        space = name.partition(":")[0]
        if targets and (space not in (*RELATIONSHIPS, OWN) or name in PURPOSE_BINDINGS):
            unread[name if space in RELATIONSHIPS else space] = None
        missing = [target for target in targets if not prim.GetStage().GetObjectAtPath(target)]
        if missing and name != "prototypes":  # An instancer names these one by one.
            unread[f"{name} (there is no {missing[0]})"] = None
    metadata = [key for key in ("customData", "assetInfo") if prim.HasAuthoredMetadata(key)]
    return [*unread, *metadata]


def _differs(prim: Usd.Prim, attribute: Usd.Attribute) -> bool:
    """Return whether an attribute has another value than the default of its prim's type, or one that cannot be read."""
    try:
        value = attribute.Get(Usd.TimeCode.EarliestTime())
    except Tf.ErrorException:
        return True
    is_empty = value is None or is_array(value) and not len(value)
    return not is_empty and value != prim.GetPrimDefinition().GetAttributeFallbackValue(attribute.GetName())


def is_array(value: Any) -> bool:
    """Return whether a value is one of USD's arrays."""
    return type(value).__module__.startswith("pxr.Vt")
