"""Puts the vertices of a file's frame into the objects that play it, whenever the frame changes, also in a render.

One decoder per file is shared by all objects, and no positions are kept but those of the frame that is shown. The
handlers outlive the loading of another .blend; paths that are relative stay so when the .blend is saved elsewhere.
"""

import os

import bpy
import numpy as np
from bpy.app.handlers import persistent

HOST_MESH = "ath_rest"  # attribute of a mesh: its rest pose in the file's axes, of files that do not hold one
DEEPEST = -1  # the level of an object that shows the deepest one in its file
_decoders: dict = {}  # path: (its size and time, the decoder, decoders of its clips by name)
_problems: dict = {}  # name of an object: the error that keeps it from playing
_moved: dict = {}  # name of an object: its path before the .blend was saved
_busy = False


def decoder_of(path: str, clip: str = ""):
    """Return a decoder of the file's clip with a name, or of its first clip for "". The file is opened again if it has
    changed. Raise OSError, athcodec's errors.
    """
    import athcodec

    status = os.stat(path)
    stamp = status.st_size, status.st_mtime_ns
    known = _decoders.get(path)
    if known is None or known[0] != stamp:
        if known is not None:
            _decoders.pop(path)[1].close()
        _decoders[path] = stamp, athcodec.open(path), {}
    _, decoder, played = _decoders[path]
    if clip and clip not in played:
        played[clip] = decoder.play(clip)
    return played[clip] if clip else decoder


def decoder_for(obj):
    """Return the decoder of what an object plays. Raises OSError, athcodec's errors."""
    decoder, rest = decoder_of(path_of(obj), obj.ath.clip), obj.data.attributes.get(HOST_MESH)
    if decoder.file.needs_host_mesh and rest is not None:
        positions = np.empty(3 * len(rest.data), np.float32)
        rest.data.foreach_get("vector", positions)
        decoder.file.set_host_mesh(positions.reshape(-1, 3))
    return decoder


def clip_names(obj) -> list[str]:
    """Return the names in the file that an object plays; none where it cannot be read."""
    try:
        return [clip.name for clip in decoder_of(path_of(obj)).file.clips if clip.name]
    except Exception:  # asked while a menu is drawn; the panel says what is wrong
        return []


def close_all() -> None:
    while _decoders:
        _decoders.popitem()[1][1].close()


def path_of(obj) -> str:
    return os.path.normpath(bpy.path.abspath(obj.ath.filepath, library=obj.library))


def problem_of(obj) -> str:
    return _problems.get(obj.name_full, "")


def level_of(obj, decoder) -> int:
    """Return the level that an object shows: what it asks for, as far as the file has it."""
    return decoder.file.deepest if obj.ath.level == DEEPEST else min(obj.ath.level, decoder.file.deepest)


def place_in(decoder, settings, scene) -> float:
    """Return the frame of the file, with a fraction between two frames, that the scene shows at its current frame."""
    rate = scene.render.fps / scene.render.fps_base
    seconds = (scene.frame_current_final - settings.frame_offset) / rate * settings.speed
    time = decoder.time - decoder.time[0]
    if decoder.clip.loop and len(time) > 1:
        time = np.append(time, time[-1] + time[-1] / (len(time) - 1))  # the first frame again, after the mean step
        seconds %= time[-1]
    elif settings.loop and len(time) > 1:
        seconds %= time[-1] + (time[-1] - time[-2])  # the last frame lasts as long as the one before
    place = float(np.interp(seconds, time, np.arange(len(time))))
    return round(place) if abs(place - round(place)) < 1e-4 else place


def positions_at(decoder, place: float, level: int) -> np.ndarray:
    """Return (N, 3) float32; between two frames on the line from one to the other, behind the last of a loop to the
    first."""
    frame = int(place)
    positions = decoder.positions(frame % decoder.frame_count, level, np.float32)
    if place > frame:
        after = decoder.positions((frame + 1) % decoder.frame_count, level, np.float32)
        positions += np.float32(place - frame) * (after - positions)
    return positions


def show(obj, scene) -> None:
    """Move an object's vertices to the scene's current frame. An error is kept for the panel and printed once."""
    if _busy or obj.type != "MESH" or not obj.ath.filepath or obj.mode == "EDIT":
        return
    try:
        _show(obj, scene)
        _problems.pop(obj.name_full, None)
    except Exception as error:  # a handler that raises stops all others
        text = " ".join(str(error).split()) or type(error).__name__
        if _problems.get(obj.name_full) != text:
            print(f"athcodec: {obj.name_full}: {text}")
        _problems[obj.name_full] = text


def _show(obj, scene) -> None:
    """Move an object's vertices to the scene's current frame. Raise ValueError if the mesh has another number of
    vertices than the file.
    """
    decoder = decoder_for(obj)
    mesh = obj.data
    if len(mesh.vertices) != decoder.file.vertex_count:
        raise ValueError(f"the mesh has {len(mesh.vertices)} vertices, the file {decoder.file.vertex_count}")
    positions = positions_at(decoder, place_in(decoder, obj.ath, scene), level_of(obj, decoder))
    mesh.vertices.foreach_set("co", positions.reshape(-1))
    mesh.update()


@persistent
def _on_frame(scene, *_) -> None:
    for obj in scene.objects:
        if obj.type == "MESH" and obj.ath.filepath:
            show(obj, scene)


@persistent
def _on_load(*_) -> None:
    close_all()
    _problems.clear()
    for scene in bpy.data.scenes:
        _on_frame(scene)


@persistent
def _on_save(target=None, *_) -> None:
    """Change the paths of files to be relative to the new folder of the .blend that is saved, because Blender does not
    change those of an extension.
    """
    global _busy
    if not isinstance(target, str) or not target:
        return
    folder, relative = os.path.dirname(target), bpy.context.preferences.filepaths.use_relative_paths
    _moved.clear()
    _busy = True
    try:
        for obj in bpy.data.objects:
            before = obj.ath.filepath
            if obj.library is None and before and (before.startswith("//") or relative):
                after = relative_path(path_of(obj), folder)
                if after != before:
                    _moved[obj.name_full] = before
                    obj.ath.filepath = after
    finally:
        _busy = False


@persistent
def _after_save(*_) -> None:
    """Restore the paths of files if only a copy of the .blend has been saved elsewhere."""
    global _busy
    _busy = True
    try:
        for name, before in _moved.items():
            obj = bpy.data.objects.get(name)
            if obj is not None and not os.path.exists(path_of(obj)):
                obj.ath.filepath = before
    finally:
        _busy = False
        _moved.clear()


def relative_path(path: str, folder: str) -> str:
    try:
        return bpy.path.relpath(path, start=folder)
    except ValueError:  # on another drive
        return path


HANDLERS = (
    ("frame_change_post", _on_frame),
    ("load_post", _on_load),
    ("save_pre", _on_save),
    ("save_post", _after_save),
)


def register() -> None:
    for name, handler in HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    for name, handler in HANDLERS:
        handlers = getattr(bpy.app.handlers, name)
        if handler in handlers:
            handlers.remove(handler)
    close_all()
