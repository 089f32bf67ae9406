"""Plant motion in Blender: meshes that play from an .ath file, and animated meshes written to one.

An imported object keeps the path of its file and nothing of its motion: the vertices are decoded when the frame
changes, at the level that the object asks for (player.py). Import and export are in the File menu.
"""

from . import exporter, importer, panel, player, settings

MODULES = (settings, player, panel, importer, exporter)


def register() -> None:
    for module in MODULES:
        module.register()


def unregister() -> None:
    for module in reversed(MODULES):
        module.unregister()
