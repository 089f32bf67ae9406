"""Blender: the extension that plays and writes .ath files there, and what makes its package.

`extension/` is the extension as Blender installs it, and imports bpy; nothing else in athcodec does.
`python -m athcodec.blender.build` packs it with the wheels that it needs.
"""
