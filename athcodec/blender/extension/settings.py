"""Settings that an object keeps in the .blend: the file it plays and how."""

# ruff: noqa: F722, F821 -- Blender's properties are annotations

import bpy
from bpy.props import BoolProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from . import player
from .player import DEEPEST


def _show(self, context) -> None:
    player.show(self.id_data, context.scene)


def _clip_names(self, context, text) -> list[str]:
    return player.clip_names(self.id_data)


class AthSettings(bpy.types.PropertyGroup):
    filepath: StringProperty(
        name="File",
        subtype="FILE_PATH",
        update=_show,
        description="The .ath file that this object's vertices come from",
    )
    clip: StringProperty(
        name="Clip",
        update=_show,
        search=_clip_names,
        search_options=set(),
        description="Which motion of the file, where it has several: its first where none is named",
    )
    level: IntProperty(
        name="Level",
        default=DEEPEST,
        min=DEEPEST,
        soft_max=16,
        update=_show,
        description="Level of detail: 0 is the coarsest, larger is closer to the source, -1 is the deepest in the file",
    )
    frame_offset: FloatProperty(
        name="Start Frame", default=1.0, update=_show, description="The frame of the scene at which the motion begins"
    )
    speed: FloatProperty(
        name="Speed", default=1.0, update=_show, description="Seconds of the motion per second of the scene"
    )
    loop: BoolProperty(
        name="Loop",
        default=False,
        update=_show,
        description="Begin again after the last frame, as clips that the file marks as loops always do",
    )


def register() -> None:
    bpy.utils.register_class(AthSettings)
    bpy.types.Object.ath = PointerProperty(type=AthSettings)


def unregister() -> None:
    del bpy.types.Object.ath
    bpy.utils.unregister_class(AthSettings)
