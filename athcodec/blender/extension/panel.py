"""The panel of an object that plays from a file: Properties, Object, Plant Motion."""

import bpy

from . import player


class OBJECT_PT_ath(bpy.types.Panel):
    bl_label = "Plant Motion (.ath)"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context) -> bool:
        return context.object is not None and context.object.type == "MESH"

    def draw(self, context) -> None:
        """Draw the panel: the settings of the object's file, and facts of it or what is wrong with it."""
        obj, layout = context.object, self.layout
        layout.use_property_split = True
        layout.prop(obj.ath, "filepath")
        if not obj.ath.filepath:
            return
        if obj.ath.clip or len(player.clip_names(obj)) > 1:
            layout.prop(obj.ath, "clip")
        for name in ("level", "frame_offset", "speed", "loop"):
            layout.prop(obj.ath, name)
        problem = player.problem_of(obj)
        if problem:
            layout.label(text=problem, icon="ERROR")
            return
        for line in self._facts(obj):
            layout.label(text=line)

    @staticmethod
    def _facts(obj) -> list[str]:
        """Return lines about the shown level, its error, and the frames and vertices of the file; one line with the
        error if it cannot be opened.
        """
        try:
            decoder = player.decoder_for(obj)
        except Exception as error:  # shown, not raised while drawing
            return [" ".join(str(error).split())]
        shown = decoder.levels[player.level_of(obj, decoder)]
        unit = decoder.metadata.get("unit", "")
        return [
            f"level {shown.level} of 0 to {decoder.file.deepest}: {shown.name}, {shown.nodes:,} nodes",
            f"largest error {shown.max_error:.3g} {unit}",
            f"{decoder.frame_count:,} frames, {decoder.fps:.6g} per second, {decoder.file.vertex_count:,} vertices",
        ]


def register() -> None:
    bpy.utils.register_class(OBJECT_PT_ath)


def unregister() -> None:
    bpy.utils.unregister_class(OBJECT_PT_ath)
