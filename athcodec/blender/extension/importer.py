"""File, Import, Plant Motion: a mesh object from an .ath file, which plays from it (see player.py).

The mesh has the file's vertices in their order, its faces, edges and static arrays. The object is turned and scaled
from the file's up axis and unit to Blender's; its vertices are the file's own numbers.
"""

# ruff: noqa: F722, F821 -- Blender's properties are annotations

import math
import os

import bpy
import numpy as np
from bpy.props import BoolProperty, CollectionProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from . import player
from .player import DEEPEST

DOMAINS = {"vertex": "POINT", "corner": "CORNER", "face": "FACE"}
KINDS = {
    ("f", ()): "FLOAT",
    ("f", (2,)): "FLOAT2",
    ("f", (3,)): "FLOAT_VECTOR",
    ("f", (4,)): "FLOAT_COLOR",
    ("i", ()): "INT",
    ("u", ()): "INT",
    ("b", ()): "BOOLEAN",
}
FIELDS = {
    "FLOAT": "value",
    "FLOAT2": "vector",
    "FLOAT_VECTOR": "vector",
    "FLOAT_COLOR": "color",
    "INT": "value",
    "BOOLEAN": "value",
}
PARENTS = "ath_branch_parent"  # a property of the mesh: the branches' parents, one per branch
NOT_SHOWN = ("face_vertex_counts", "face_vertex_indices", "part_vertex_counts", "curve_vertex_counts")


class IMPORT_OT_ath(bpy.types.Operator, ImportHelper):
    """Import plant motion that plays from its file"""

    bl_idname = "import_scene.ath"
    bl_label = "Import Plant Motion"
    bl_options = {"REGISTER", "UNDO"}

    filename_ext = ".ath"
    filter_glob: StringProperty(default="*.ath", options={"HIDDEN"})
    files: CollectionProperty(type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"})
    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    level: IntProperty(
        name="Level",
        default=DEEPEST,
        min=DEEPEST,
        description="Level of detail: 0 is the coarsest, -1 the deepest in the file",
    )
    clip: StringProperty(name="Clip", description="The motion to play, of a file that has several: else the first")
    host_mesh: StringProperty(
        name="Mesh",
        subtype="FILE_PATH",
        description="The mesh that the file was made for, of a file that does not hold its rest pose: any format that "
        "athcodec reads, with the same vertices. The object keeps it",
    )
    loop: BoolProperty(name="Loop", default=False, description="Begin again after the last frame")
    set_scene: BoolProperty(
        name="Set Scene", default=True, description="Give the scene the frame rate and the frames of the motion"
    )
    use_relative: BoolProperty(
        name="Relative Path",
        default=True,
        description="Keep the path relative to the .blend, where that has been saved",
    )

    def execute(self, context):
        """Add an object for each chosen file, and report the first error in one line."""
        names = [file.name for file in self.files if file.name]
        paths = [os.path.join(self.directory, name) for name in names] or [self.filepath]
        for path in paths:
            try:
                obj = add_object(
                    context,
                    path,
                    self.level,
                    loop=self.loop,
                    set_scene=self.set_scene,
                    use_relative=self.use_relative,
                    clip=self.clip,
                    host_mesh=self.host_mesh,
                )
            except Exception as error:  # Any fault of the file is reported in one line.
                self.report({"ERROR"}, " ".join(f"{path}: {error}".split()))
                return {"CANCELLED"}
            for selected in context.selected_objects:
                selected.select_set(False)
            obj.select_set(True)
            context.view_layer.objects.active = obj
        return {"FINISHED"}


class IO_FH_ath(bpy.types.FileHandler):
    """Files that are dropped into a window"""

    bl_idname = "IO_FH_ath"
    bl_label = "Plant Motion"
    bl_import_operator = "import_scene.ath"
    bl_file_extensions = ".ath"

    @classmethod
    def poll_drop(cls, context) -> bool:
        return context.area is not None and context.area.type in ("VIEW_3D", "OUTLINER")


def add_object(
    context,
    path: str,
    level: int = DEEPEST,
    *,
    loop: bool = False,
    set_scene: bool = True,
    use_relative: bool = True,
    clip: str = "",
    host_mesh: str = "",
):
    """Add an object that plays the file at `path` to the active collection, and return it. `set_scene` sets the scene's
    frame rate and range from the file. Raise OSError, athcodec's errors.
    """
    from athcodec.opening import set_host_mesh_of

    path = os.path.normpath(bpy.path.abspath(path))
    decoder = player.decoder_of(path, clip)
    if host_mesh:
        set_host_mesh_of(decoder.file, bpy.path.abspath(host_mesh))
    name = os.path.splitext(os.path.basename(path))[0]
    obj = bpy.data.objects.new(name, _mesh(name, decoder))
    context.collection.objects.link(obj)
    _place(obj, decoder, context.scene)
    first, rate = _timing(decoder, context.scene)
    if set_scene:
        _set_scene(context.scene, decoder, first, rate)
    context.scene.render.use_lock_interface = True  # meshes change while a render goes through the frames
    settings = obj.ath
    settings.level, settings.loop, settings.frame_offset, settings.clip = level, loop, first, decoder.clip.name
    relative = use_relative and bpy.data.is_saved
    settings.filepath = player.relative_path(path, os.path.dirname(bpy.data.filepath)) if relative else path
    player.show(obj, context.scene)
    return obj


def _timing(decoder, scene) -> tuple[float, float]:
    """Return the scene's frame at which the file begins, and the file's frames per second."""
    metadata = decoder.metadata
    rate = float(metadata.get("fps") or decoder.fps or scene.render.fps / scene.render.fps_base)
    first = metadata.get("start_frame", scene.frame_start)
    return float(first) + float(decoder.time[0]) * rate if "start_frame" in metadata else float(first), rate


def _set_scene(scene, decoder, first: float, rate: float) -> None:
    scene.render.fps = max(1, round(rate))
    scene.render.fps_base = scene.render.fps / rate
    scene.frame_start = math.floor(first)
    scene.frame_end = max(scene.frame_start, math.floor(first + (decoder.time[-1] - decoder.time[0]) * rate + 1e-4))


def _place(obj, decoder, scene) -> None:
    from athcodec.motion.units import metres_of

    up_axis = str(decoder.metadata.get("up_axis", "z")).lower()
    obj.rotation_euler = {"y": (math.pi / 2, 0, 0), "x": (0, -math.pi / 2, 0)}.get(up_axis, (0, 0, 0))
    metres = metres_of(decoder.metadata) or 1.0
    obj.scale = (metres / scene.unit_settings.scale_length,) * 3


def _mesh(name: str, decoder):
    """Return a new mesh in the rest pose of a decoder's file, with its faces, edges and attributes."""
    from athcodec.motion.clip import polygons

    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(decoder.file.vertex_count)
    mesh.vertices.foreach_set("co", np.ascontiguousarray(decoder.file.rest, np.float32).reshape(-1))
    if decoder.file.host_checksum is not None:
        layer = mesh.attributes.new(player.HOST_MESH, "FLOAT_VECTOR", "POINT")
        layer.data.foreach_set("vector", np.ascontiguousarray(decoder.file.rest, np.float32).reshape(-1))
    faces = polygons(decoder.file.faces, decoder.file.attributes)
    if faces is not None:
        _add_faces(mesh, *faces)
    if decoder.file.edges is not None and len(decoder.file.edges):
        mesh.edges.add(len(decoder.file.edges))
        mesh.edges.foreach_set("vertices", np.ascontiguousarray(decoder.file.edges, np.int32).reshape(-1))
    mesh.update(calc_edges=faces is not None)
    corners = len(faces[1]) if faces is not None else 0
    if len(mesh.loops) == corners:
        _add_attributes(mesh, decoder)
    return mesh


def _add_faces(mesh, counts: np.ndarray, indices: np.ndarray) -> None:
    counts = np.asarray(counts, np.int32)
    mesh.loops.add(len(indices))
    mesh.loops.foreach_set("vertex_index", np.ascontiguousarray(indices, np.int32))
    mesh.polygons.add(len(counts))
    mesh.polygons.foreach_set("loop_start", np.cumsum(counts, dtype=np.int32) - counts)


def _add_attributes(mesh, decoder) -> None:
    """Add the file's attributes and branches to the mesh, as far as Blender has a type and a domain for them."""
    domains = decoder.metadata.get("domains", {})
    arrays = {**decoder.file.attributes, "vertex_branch": decoder.file.vertex_branch}
    if decoder.file.stem_index is not None:
        arrays["stem_index"] = decoder.file.stem_index
    mesh[PARENTS] = np.asarray(decoder.file.branch_parent).tolist()
    rows = {"POINT": len(mesh.vertices), "CORNER": len(mesh.loops), "FACE": len(mesh.polygons)}
    for name, values in arrays.items():
        domain = DOMAINS.get(domains.get(name, "vertex") if isinstance(domains, dict) else "vertex")
        kind = KINDS.get((values.dtype.kind, values.shape[1:]))
        if domain is None or kind is None or len(values) != rows[domain] or name in NOT_SHOWN or not rows[domain]:
            continue
        if name == "uv" and kind == "FLOAT2" and rows["CORNER"]:
            _add_uv(mesh, values, domain)
        else:
            dtype = {"INT": np.int32, "BOOLEAN": bool}.get(kind, np.float32)
            layer = mesh.attributes.new(name, kind, domain)
            layer.data.foreach_set(FIELDS[kind], np.ascontiguousarray(values, dtype).reshape(-1))


def _add_uv(mesh, values: np.ndarray, domain: str) -> None:
    """Add texture coordinates as a UV map. `domain` is "POINT" or "CORNER"; those of faces are left out."""
    if domain == "FACE":
        return
    if domain == "POINT":
        corners = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", corners)
        values = values[corners]
    layer = mesh.uv_layers.new(name="uv")
    layer.data.foreach_set("uv", np.ascontiguousarray(values, np.float32).reshape(-1))


def _menu(self, context) -> None:
    self.layout.operator(IMPORT_OT_ath.bl_idname, text="Plant Motion (.ath)")


CLASSES = (IMPORT_OT_ath, IO_FH_ath)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.TOPBAR_MT_file_import.append(_menu)


def unregister() -> None:
    bpy.types.TOPBAR_MT_file_import.remove(_menu)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
