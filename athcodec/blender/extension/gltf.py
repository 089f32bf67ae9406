"""File, Export, glTF 2.0: the motion of meshes that bend goes into the glTF that Blender writes, as ATH_motion.

Blender's exporter writes skins and shape keys, and of what modifiers, simulations and .ath files move one pose. Where
the scene asks for it, each frame is evaluated before that export, and objects whose vertices move in their own space
get a motion, whose rest pose is the mesh that Blender writes. Its exporter calls the hooks below; which vertex of
Blender's mesh each of glTF's is, only the exporter knows, so an attribute is added to what it writes.
"""

# ruff: noqa: F722, F821 -- Blender's properties are annotations

import os
import tempfile
from contextlib import ExitStack

import bpy
import numpy as np
from bpy.props import BoolProperty, FloatProperty, PointerProperty

from .exporter import Recording, encoded, frame_rate, set_frame

EXTENSION = "ATH_motion"
VERTEX = "_ATH_VERTEX"
FLOAT = 5126
PANEL = "athcodec"


class AthGltfSettings(bpy.types.PropertyGroup):
    use: BoolProperty(
        name="Motion of Vertices",
        default=False,
        description="Write what modifiers, simulations and .ath files move, compressed (ATH_motion)",
    )
    rel_error: FloatProperty(
        name="Error",
        default=1e-4,
        min=1e-9,
        max=1.0,
        precision=6,
        description="At most this fraction of the diagonal of the box around the whole motion of an object",
    )


class glTF2ExportUserExtension:
    """Receiver of the calls of Blender's exporter; one for each export."""

    def __init__(self):
        from io_scene_gltf2.io.com import gltf2_io_extensions as extensions
        from io_scene_gltf2.io.exp.binary_data import BinaryData

        self._extensions, self._binary = extensions, BinaryData
        self._recordings, self._primitives, self._open = {}, [], ExitStack()
        self._first = {}  # By id: primitives whose vertices are numbered as the motion numbers them.

    def pre_export_hook(self, export_settings):
        """Record the positions of all objects that may move, in all frames of the scene, before the export begins."""
        scene = bpy.context.scene
        if not scene.ath_gltf.use:
            return
        if export_settings["gltf_draco_mesh_compression"]:
            raise ValueError("got Draco, expected none: the motion's rest pose is the mesh bit for bit")
        before, objects = scene.frame_current_final, list(self._objects(export_settings))
        self._recordings = {obj.name: Recording(obj, self._spool(), world=False) for obj in objects}
        try:
            for frame in range(scene.frame_start, scene.frame_end + 1):
                set_frame(scene, frame)
                for recording in self._recordings.values():
                    recording.add(bpy.context, frame)
        finally:
            set_frame(scene, before)
        self._recordings = {name: each for name, each in self._recordings.items() if each.moves}

    def _spool(self):
        return self._open.enter_context(tempfile.TemporaryFile())

    def _objects(self, export_settings):
        """Return the objects that are exported as meshes without a skin."""
        for obj in bpy.context.view_layer.objects:
            has_skin = export_settings["gltf_skins"] and any(each.type == "ARMATURE" for each in obj.modifiers)
            chosen = not export_settings["gltf_selected"] or obj.select_get()
            if obj.type == "MESH" and len(obj.data.vertices) and chosen and not has_skin:
                yield obj

    def gather_attributes_change(self, attributes, export_settings):
        """Add an attribute to a mesh that has the number of Blender's vertex for each written vertex."""
        if not self._recordings:
            return
        position = next(each for each in attributes if each["gltf_attribute_name"] == "POSITION")
        [creator] = [cell.cell_contents for cell in position["set"].__closure__ or ()]

        def set_vertices(attribute, edges_points=False):
            attributes = creator.attributes_edges_points if edges_points else creator.attributes
            # The numbers are exact in float32: meshes of more vertices have no export.
            data = np.asarray(creator.blender_idxs, np.float32)[:, None]
            attributes[VERTEX] = {"data": data, "data_type": "SCALAR", "component_type": FLOAT}

        kind = {"blender_data_type": "FLOAT", "blender_domain": "POINT", "len": 1, "type": np.float32}
        attributes.append({"gltf_attribute_name": VERTEX, "skip_getting_to_dots": True, "set": set_vertices} | kind)

    def gather_node_hook(self, node, blender_object, export_settings):
        """Attach the recorded motion of an object to the primitives of its node, by ATH_motion."""
        primitives = node.mesh.primitives if node.mesh is not None else []
        self._primitives += primitives
        recording = self._recordings.get(blender_object.name) if blender_object else None
        if recording is None or not primitives:
            return
        if any(EXTENSION in (each.extensions or {}) for each in primitives):
            return  # as another object shows the same mesh
        motion = self._motion(recording, blender_object, primitives, export_settings)
        for primitive in primitives:
            reference = self._extensions.ChildOfRootExtension(["motions"], EXTENSION, motion, required=False)
            content = {"motion": reference} | self._first.get(id(primitive), {})
            extension = self._extensions.Extension(EXTENSION, content, required=False)
            primitive.extensions = (primitive.extensions or {}) | {EXTENSION: extension}

    def gather_gltf_hook(self, active_scene, scenes, animations, export_settings):
        """Leave meshes without a motion as they would be."""
        for primitive in self._primitives:
            if EXTENSION not in (primitive.extensions or {}):
                primitive.attributes.pop(VERTEX, None)

    def _motion(self, recording, obj, primitives, export_settings) -> dict:
        """Return the entry of ATH_motion for a recording. The vertex attribute of the primitives is changed to number
        the vertices of the motion.
        """
        if not export_settings["gltf_apply"] and len(obj.data.vertices) != recording.vertex_count:
            raise ValueError(
                f"{obj.name}: got {recording.vertex_count} vertices that move and {len(obj.data.vertices)} that are "
                "written, expected as many: apply modifiers in the export"
            )
        if any(VERTEX not in each.attributes for each in primitives):
            raise ValueError(f"{obj.name}: got no numbers of vertices from this version of Blender's exporter")
        numbers = [self._values(each.attributes[VERTEX])[:, 0].astype(np.int64) for each in primitives]
        used, places = np.unique(np.concatenate(numbers), return_inverse=True)
        rest = np.empty((len(used), 3), np.float32)
        rest[places.ravel()] = np.concatenate([self._values(each.attributes["POSITION"]) for each in primitives])
        stops = np.cumsum([len(each) for each in numbers])[:-1]
        for primitive, numbers_of_primitive in zip(primitives, np.split(places.ravel(), stops)):
            view = primitive.attributes[VERTEX].buffer_view
            if np.array_equal(numbers_of_primitive, numbers_of_primitive[0] + np.arange(len(numbers_of_primitive))):
                del primitive.attributes[VERTEX]
                self._first[id(primitive)] = (
                    {"firstVertex": int(numbers_of_primitive[0])} if numbers_of_primitive[0] else {}
                )
            else:
                view = self._binary(numbers_of_primitive.astype(np.float32).tobytes(), view.bufferViewTarget)
                primitive.attributes[VERTEX].buffer_view = view
        ath = self._encoded(recording, used, rest, export_settings)
        scene, name = bpy.context.scene, bpy.context.scene.name
        start = 0.0 if export_settings.get("gltf_anim_slide_to_zero") else scene.frame_start / frame_rate(scene)
        clips = [{"name": name, "start": start}] if start else []
        return {"name": recording.name, "bufferView": self._binary(ath)} | ({"clips": clips} if clips else {})

    @staticmethod
    def _values(accessor) -> np.ndarray:
        return np.frombuffer(accessor.buffer_view.data, np.float32).reshape(accessor.count, -1)

    def _encoded(self, recording, used, rest, export_settings) -> bytes:
        """Return the motion of the vertices `used` as the bytes of an .ath file, in glTF's axes if the export has y up.
        `rest` (V, 3) is the rest pose.
        """
        from athcodec.motion.clip import ClipRange
        from athcodec.motion.frames import Frames

        clip = recording.clip(bpy.context.scene)
        source, is_y_up = clip.positions, export_settings["gltf_yup"]

        def read(start, stop):
            points = np.asarray(source[start:stop])[:, used]
            return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1) if is_y_up else points

        place = np.full(clip.vertex_count, -1, np.int32)
        place[used] = np.arange(len(used))
        has_all = clip.branch_parent is not None and len(np.unique(clip.vertex_branch[used])) == len(clip.branch_parent)
        faces = None if clip.faces is None else place[clip.faces]
        moved = clip.replace(
            positions=Frames(read, clip.frame_count, len(used)),
            rest=rest,
            rest_given=True,
            faces=None if faces is None or (faces < 0).any() else faces,
            edges=None,
            attributes={},
            vertex_branch=clip.vertex_branch[used] if has_all else None,
            branch_parent=clip.branch_parent if has_all else None,
            stem_index=None,
            clip_ranges=(ClipRange(bpy.context.scene.name, clip.frame_count),),
            metadata={key: clip.metadata[key] for key in ("fps", "start_frame")},
        )
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "motion.ath")
            encoded(moved, path, attributes="none", host_rest=True, rel_error=bpy.context.scene.ath_gltf.rel_error)
            with open(path, "rb") as file:
                return file.read()

    def post_export_hook(self, export_settings):
        self._recordings = {}
        self._open.close()


def _draw(context, layout) -> None:
    header, body = layout.panel("athcodec_gltf", default_closed=False)
    header.label(text="Plant Motion (.ath)")
    if body:
        body.use_property_split = True
        for name in ("use", "rel_error"):
            body.prop(context.scene.ath_gltf, name)


def register() -> None:
    """Register the settings and the panel of the glTF export with Blender."""
    bpy.utils.register_class(AthGltfSettings)
    bpy.types.Scene.ath_gltf = PointerProperty(type=AthGltfSettings)
    try:
        from io_scene_gltf2 import exporter_extension_layout_draw
    except ImportError:  # Blender without its exporter
        return
    exporter_extension_layout_draw[PANEL] = _draw


def unregister() -> None:
    """Remove the settings and the panel of the glTF export from Blender."""
    try:
        from io_scene_gltf2 import exporter_extension_layout_draw
    except ImportError:
        pass
    else:
        exporter_extension_layout_draw.pop(PANEL, None)
    del bpy.types.Scene.ath_gltf
    bpy.utils.unregister_class(AthGltfSettings)
