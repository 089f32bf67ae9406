"""Plant motion in Blender: meshes that play from an .ath file, and animated meshes written to one.

An imported object keeps the path of its file and nothing of its motion: the vertices are decoded when the frame
changes, at the level that the object asks for (player.py). Import and export are in the File menu; Blender's own
export to glTF writes the motion too, where the scene asks for it (gltf.py).
"""

from . import exporter, gltf, importer, panel, player, settings
from .gltf import glTF2ExportUserExtension  # noqa: F401 -- Blender's glTF exporter looks for it here

MODULES = (settings, player, panel, importer, exporter, gltf)


def register() -> None:
    for module in MODULES:
        module.register()


def unregister() -> None:
    for module in reversed(MODULES):
        module.unregister()
