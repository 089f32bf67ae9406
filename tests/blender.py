"""A Blender for tests: the module bpy in a Python of its own, and athcodec's extension installed in it.

Which Python that is, says programs.py. A test gives `Blender.run` a script, which finds its arguments in
`args` and saves arrays with `save(name=array)`.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
HEADER = """
import json, sys
import bpy
import numpy as np
args = json.loads(sys.argv[1])
def save(**arrays):
    np.savez(sys.argv[2], **arrays)
def fresh():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if args.get("extension"):
        bpy.ops.preferences.addon_enable(module="bl_ext.user_default.athcodec")
def world(name):
    evaluated = bpy.data.objects[name].evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    matrix = np.array(evaluated.matrix_world)
    evaluated.to_mesh_clear()
    return points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
"""
INSTALL = """
fresh()
done = bpy.ops.extensions.package_install_files(filepath=args["zip"], repo="user_default", enable_on_install=True)
assert done == {"FINISHED"}, done
assert "bl_ext.user_default.athcodec" in bpy.context.preferences.addons
"""


class Blender:
    """Runs scripts in Blender, with settings of its own in `folder`."""

    def __init__(self, python: Path, folder: Path):
        self.python, self.folder = python, folder
        self._count = 0
        self.has_extension = False

    def run(self, script: str, **args: object) -> dict[str, np.ndarray]:
        self._count += 1
        name, out = self.folder / f"script{self._count}.py", self.folder / f"out{self._count}.npz"
        name.write_text(HEADER + script)
        args = {"extension": self.has_extension, **args}
        env = {**os.environ, "BLENDER_USER_RESOURCES": str(self.folder / "user")}
        done = subprocess.run(
            [self.python, str(name), json.dumps(args, default=str), str(out)], env=env, text=True, capture_output=True
        )
        assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
        if not out.exists():
            return {}
        with np.load(out) as arrays:
            return dict(arrays)


def build_extension(folder: Path) -> Path:
    """The extension's package, from a wheel of the source tree."""
    subprocess.run([sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", folder, ROOT], check=True)
    output = folder / "athcodec-blender.zip"
    wheels = list(folder.glob("athcodec-*.whl"))
    subprocess.run([sys.executable, "-m", "athcodec.blender.build", output, *wheels], check=True)
    return output
