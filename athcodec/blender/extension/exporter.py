"""File, Export, Plant Motion: the active object, as its modifiers leave it in each frame, compressed to an .ath file.

The frames go to a temporary file first, uncompressed: Blender evaluates each once, the encoder reads them twice.
Branches come from the vertex attribute vertex_branch, with the mesh's property ath_branch_parent, where both are there
(an imported mesh has them), else athcodec finds them, by the armature if there is one. That takes scipy, which Blender
has not got: without it the pieces of the mesh are the branches, and files are larger.
"""

# ruff: noqa: F722, F821 -- Blender's properties are annotations

import math
import tempfile
from importlib.util import find_spec

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from .importer import FIELDS, KINDS, PARENTS

DOMAINS = {"POINT": "vertex", "CORNER": "corner", "FACE": "face"}
WIDTHS = {kind: row for (_, row), kind in KINDS.items()}


class EXPORT_OT_ath(bpy.types.Operator, ExportHelper):
    """Compress the motion of the active object"""

    bl_idname = "export_scene.ath"
    bl_label = "Export Plant Motion"

    filename_ext = ".ath"
    filter_glob: StringProperty(default="*.ath", options={"HIDDEN"})
    bound: EnumProperty(
        name="Error",
        default="RELATIVE",
        items=(
            ("RELATIVE", "Relative", "At most a fraction of the diagonal of the box around the whole motion"),
            ("LENGTH", "Length", "At most a length in the scene's units"),
            ("LOSSLESS", "Lossless", "Every bit of the positions"),
        ),
    )
    rel_error: FloatProperty(name="Fraction", default=1e-4, min=1e-9, max=1.0, precision=6)
    max_error: FloatProperty(name="Length", default=0.001, min=1e-12, precision=6, unit="LENGTH")
    effort: EnumProperty(
        name="Effort",
        default="default",
        items=(("fast", "Fast", "Quick, larger"), ("default", "Default", ""), ("best", "Best", "Slow, smaller")),
    )
    space: EnumProperty(
        name="Space",
        default="WORLD",
        items=(
            ("WORLD", "World", "With the transforms of the object and of its parents"),
            ("LOCAL", "Local", "As the mesh has them, for an object that is imported again below the same parents"),
        ),
    )
    attributes: BoolProperty(name="Static Data", default=True, description="Faces, texture coordinates and attributes")

    @classmethod
    def poll(cls, context) -> bool:
        return context.active_object is not None and context.active_object.type == "MESH"

    def execute(self, context):
        """Compress the active object to the chosen file and report the size, or the error in one line."""
        try:
            summary = write_object(
                context,
                context.active_object,
                self.filepath,
                self.space == "WORLD",
                self.effort,
                self.attributes,
                **self._bound(),
            )
        except Exception as error:  # reported in one line
            self.report({"ERROR"}, " ".join(str(error).split()) or type(error).__name__)
            return {"CANCELLED"}
        self.report({"INFO"}, f"{summary.bytes:,} bytes, {summary.ratio:.1f} times smaller")
        if left_out := left_out_of(context, summary):
            self.report({"WARNING"}, f"not written: {left_out}")
        return {"FINISHED"}

    def _bound(self) -> dict:
        if self.bound == "LENGTH":
            return {"max_error": self.max_error}
        return {"lossless": True} if self.bound == "LOSSLESS" else {"rel_error": self.rel_error}


def left_out_of(context, summary) -> str:
    """Return what is selected besides the active object, and what of that is not in the file, in words; "" for
    nothing."""
    from athcodec.sources import listed

    others = [obj.name for obj in context.selected_objects if obj != context.active_object]
    return listed({**({"object": others} if others else {}), **summary.not_read})


def write_object(
    context, obj, path: str, world: bool = True, effort: str = "default", attributes: bool = True, **bound
):
    """Compress the motion of an object in the scene's frames to an .ath file and return athcodec's Summary. `world`
    takes positions in the world's space, and `bound` has options of the error bound. Raise athcodec's errors, OSError.
    """
    scene = context.scene
    before, frames = scene.frame_current_final, range(scene.frame_start, scene.frame_end + 1)
    manager = context.window_manager
    manager.progress_begin(0, 1)
    try:
        with tempfile.TemporaryFile() as spool:
            recording = Recording(obj, spool, world)
            for number, frame in enumerate(frames, 1):
                set_frame(scene, frame)
                recording.add(context, frame)
                manager.progress_update(number / len(frames) / 2)
            return encoded(
                recording.clip(scene),
                bpy.path.abspath(path),
                effort=effort,
                attributes="all" if attributes else "none",
                progress=lambda stage, done: manager.progress_update(0.5 + done / 2),
                **bound,
            )
    finally:
        manager.progress_end()
        set_frame(scene, before)


def encoded(clip, path: str, **options):
    """Encode a clip to a file and return athcodec's Summary. If no branches are named and none can be found, the
    connected pieces of the mesh are the branches.
    """
    import athcodec
    from athcodec.motion.branches.finding import pieces
    from athcodec.motion.branches.result import with_branches

    if not clip.has_branches and find_spec("scipy") is None:
        clip = with_branches(clip, pieces(clip))
    return athcodec.encode(clip, path, **options)


def set_frame(scene, frame: float) -> None:
    scene.frame_set(math.floor(frame), subframe=frame - math.floor(frame))


def frame_rate(scene) -> float:
    return scene.render.fps / scene.render.fps_base


class Recording:
    """The frames of an object as they come, in the file `spool`; `moves`: whether any is other than the first."""

    def __init__(self, obj, spool, world: bool):
        self.name, self.moves, self.vertex_count = obj.name, False, 0
        self._obj, self._spool, self._world = obj, spool, world
        self._frames, self._first, self._shape, self._static = [], None, None, {}

    def add(self, context, frame: int) -> None:
        """Add the object's positions in a frame that the scene shows at present. Raise ValueError if the number of
        vertices or the faces have changed.
        """
        evaluated = self._obj.evaluated_get(context.evaluated_depsgraph_get())
        mesh = evaluated.to_mesh()
        try:
            positions = _positions(mesh, evaluated.matrix_world if self._world else None)
            if self._first is None:
                self._static, self._shape, self._first = _static(mesh, self._obj), _shape(mesh), positions
                self.vertex_count = len(positions)
            elif _shape(mesh) != self._shape:
                raise ValueError(
                    f"{self.name}: the vertices or faces change in frame {frame}, expected the same in all"
                )
        finally:
            evaluated.to_mesh_clear()
        self.moves = self.moves or not np.array_equal(positions, self._first)
        self._frames.append(frame)
        self._spool.write(positions.tobytes())

    def clip(self, scene):
        """Return the recorded frames as a MotionClip."""
        from athcodec.motion.clip import MotionClip

        self._spool.flush()
        positions = np.memmap(self._spool, np.float32, "r", shape=(len(self._frames), self.vertex_count, 3))
        static, rate = dict(self._static), frame_rate(scene)
        metadata = {
            "fps": rate,
            "start_frame": self._frames[0],
            "up_axis": "z",
            **_unit(scene, self._world),
            "part_names": [self.name],
            "part_kinds": ["mesh"],
            "domains": static.pop("domains"),
        }
        materials = [slot.material.name for slot in self._obj.material_slots if slot.material]
        not_read = {"attribute": static.pop("left_out"), "material": materials}
        skin = _skin(self._obj, self.vertex_count)
        return MotionClip(
            positions,
            np.arange(len(positions)) / rate,
            metadata=metadata,
            skin=skin,
            not_read={kind: names for kind, names in not_read.items() if names},
            **static,
        )


def _shape(mesh) -> tuple[int, int, int, int]:
    """Return what has to stay the same over all frames: numbers of vertices, edges, faces, and a hash of which
    vertices the corners are."""
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    return len(mesh.vertices), len(mesh.edges), len(mesh.polygons), hash(corners.tobytes())


def _positions(mesh, matrix) -> np.ndarray:
    """Return the positions (N, 3) of a mesh, float32, moved by a 4 by 4 matrix unless it is None."""
    positions = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", positions)
    positions = positions.reshape(-1, 3)
    if matrix is None:
        return positions
    matrix = np.array(matrix)
    return (positions @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)


def _unit(scene, world: bool) -> dict:
    """Return the metadata that states the scene's unit; empty if the scene has none or positions are in the object's
    own space.
    """
    from athcodec.motion.units import METRES, METRES_PER_UNIT

    if scene.unit_settings.system == "NONE" or not world:
        return {}
    scale = scene.unit_settings.scale_length
    symbols = [symbol for symbol, metres in METRES.items() if math.isclose(metres, scale, rel_tol=1e-5)]
    return {"unit": symbols[-1]} if symbols else {METRES_PER_UNIT: float(scale)}


def _static(mesh, obj) -> dict:
    """Return three results: the arguments of MotionClip that are constant in time, such as faces, the domains of
    attributes by name, and the names of the attributes left out.
    """
    fields, arrays, domains = {}, {}, {}
    counts = np.empty(len(mesh.polygons), np.int32)
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.polygons.foreach_get("loop_total", counts)
    mesh.loops.foreach_get("vertex_index", corners)
    if len(counts) and counts.min() == counts.max():
        fields["faces"] = corners.reshape(len(counts), -1)
    elif len(counts):
        arrays |= {"face_vertex_counts": counts, "face_vertex_indices": corners}
        domains |= {"face_vertex_counts": "face", "face_vertex_indices": "corner"}
    elif len(mesh.edges):
        edges = np.empty(2 * len(mesh.edges), np.int32)
        mesh.edges.foreach_get("vertices", edges)
        fields["edges"] = edges.reshape(-1, 2)
    if mesh.uv_layers.active is not None and len(corners):
        uv = np.empty(2 * len(corners), np.float32)
        mesh.uv_layers.active.data.foreach_get("uv", uv)
        arrays["uv"], domains["uv"] = uv.reshape(-1, 2), "corner"
    left_out = _add_attributes(mesh, arrays, domains)
    _take_branches(obj, arrays, fields)
    return {**fields, "attributes": arrays, "domains": domains, "left_out": left_out}


def _add_attributes(mesh, arrays: dict, domains: dict) -> list[str]:
    """Add the mesh's attributes that an .ath file can hold to `arrays` and `domains`, and return the names of the
    others.
    """
    from athcodec.motion.clip import RESERVED_NAMES

    active = mesh.uv_layers.active
    left_out = [layer.name for layer in mesh.uv_layers if active is None or layer.name != active.name]
    uv_names = {layer.name for layer in mesh.uv_layers}
    kept = ("vertex_branch", "stem_index")
    for layer in mesh.attributes:
        if layer.is_internal or layer.name.startswith(".") or layer.name in uv_names or layer.name == "position":
            continue
        known = layer.domain in DOMAINS and layer.data_type in FIELDS and len(layer.data)
        is_taken = layer.name in arrays or layer.name in RESERVED_NAMES and layer.name not in kept
        if not known or is_taken or layer.name in ("sharp_face", "material_index"):
            left_out += [layer.name] if len(layer.data) else []
            continue
        row = WIDTHS[layer.data_type]
        dtype = {"INT": np.int32, "BOOLEAN": bool}.get(layer.data_type, np.float32)
        values = np.empty(len(layer.data) * int(np.prod(row, dtype=int)), dtype)
        layer.data.foreach_get(FIELDS[layer.data_type], values)
        arrays[layer.name] = values.reshape(len(layer.data), *row)
        if layer.domain != "POINT":
            domains[layer.name] = DOMAINS[layer.domain]
    return left_out


def _take_branches(obj, arrays: dict, fields: dict) -> None:
    """Move the branches that an imported mesh has as attributes from `arrays` to `fields`, the arguments of
    MotionClip.
    """
    vertex_branch, stem_index = arrays.pop("vertex_branch", None), arrays.pop("stem_index", None)
    parents = obj.data.get(PARENTS)
    if vertex_branch is not None and parents is not None:
        fields |= {"vertex_branch": vertex_branch, "branch_parent": np.array(parents, np.int32)}
        if stem_index is not None:
            fields["stem_index"] = stem_index
    elif vertex_branch is not None:
        arrays["branch_id"] = vertex_branch


def _skin(obj, vertex_count: int):
    """Return the skin of the armature that moves the object, from which branches are found: the parents of its bones,
    the bone with the largest weight at each vertex, and the bones' names. Return None without an armature.
    """
    from athcodec.motion.clip import Skin

    armatures = (modifier.object for modifier in obj.modifiers if modifier.type == "ARMATURE")
    armature = next(filter(None, armatures), None)
    if armature is None or len(obj.data.vertices) != vertex_count:
        return None
    bones = list(armature.data.bones)  # parents first
    places = {bone.name: i for i, bone in enumerate(bones)}
    parents = [places[bone.parent.name] if bone.parent else -1 for bone in bones]
    joints = [places.get(group.name, -1) for group in obj.vertex_groups]
    of_vertex = np.full(vertex_count, -1, np.int32)
    for vertex in obj.data.vertices:
        weights = [(group.weight, joints[group.group]) for group in vertex.groups if joints[group.group] >= 0]
        if weights:
            of_vertex[vertex.index] = max(weights)[1]
    if any(parent >= i for i, parent in enumerate(parents)):
        return None
    return Skin(np.array(parents, np.int32), of_vertex, [bone.name for bone in bones])


def _menu(self, context) -> None:
    self.layout.operator(EXPORT_OT_ath.bl_idname, text="Plant Motion (.ath)")


def register() -> None:
    bpy.utils.register_class(EXPORT_OT_ath)
    bpy.types.TOPBAR_MT_file_export.append(_menu)


def unregister() -> None:
    bpy.types.TOPBAR_MT_file_export.remove(_menu)
    bpy.utils.unregister_class(EXPORT_OT_ath)
