"""The walking panda that Panda3D ships (a rig of people, 61 frames), as Panda3D moves it: python panda.py OUT.npz

positions (61, 1338, 3), faces, and the rig: joints (1338, 4), weights (1338, 4), and matrices (61, J, 4, 4) that take a
vertex from its bind pose to the frame."""

import os
import sys

import numpy as np
import panda3d
from panda3d.core import Filename, GeomVertexReader, LMatrix4f, Thread, getModelPath, loadPrcFileData

loadPrcFileData("", "window-type none\naudio-library-name null")
getModelPath().appendDirectory(Filename.fromOsSpecific(os.path.join(os.path.dirname(panda3d.__file__), "models")))

from direct.actor.Actor import Actor  # noqa: E402, after the settings
from direct.showbase.ShowBase import ShowBase  # noqa: E402

base = ShowBase(windowType="none")
actor = Actor("panda-model", {"walk": "panda-walk4"})
geom = actor.findAllMatches("**/+GeomNode")[0].node().getGeom(0)
table = geom.getVertexData().getTransformBlendTable()


def column(data, name, get):
    reader, found = GeomVertexReader(data, name), []
    while not reader.isAtEnd():
        found.append(get(reader))
    return found


def point(reader):
    return tuple(reader.getData3())


names = {}
blends = column(geom.getVertexData(), "transform_blend", lambda reader: reader.getData1i())
joints, weights = np.zeros((len(blends), 4), np.uint8), np.zeros((len(blends), 4), np.float32)
transforms = {}
for vertex, blend in enumerate(map(table.getBlend, blends)):
    for slot in range(blend.getNumTransforms()):
        transform = blend.getTransform(slot)
        name = transform.getJoint().getName()
        transforms[name] = transform
        joints[vertex, slot] = names.setdefault(name, len(names))
        weights[vertex, slot] = blend.getWeight(slot)
positions, matrices = [], []
for frame in range(actor.getNumFrames("walk")):
    actor.pose("walk", frame)
    actor.update(force=True)
    moved = actor.findAllMatches("**/+GeomNode")[0].node().getGeom(0).getVertexData()
    positions.append(column(moved.animateVertices(True, Thread.getCurrentThread()), "vertex", point))
    matrices.append([])
    for name in names:
        matrix = LMatrix4f()
        transforms[name].getMatrix(matrix)
        matrices[-1].append([[matrix.getCell(row, cell) for row in range(4)] for cell in range(4)])
primitive = geom.getPrimitive(0).decompose()
faces = np.array([primitive.getVertex(i) for i in range(primitive.getNumVertices())]).reshape(-1, 3)
np.savez(
    sys.argv[1],
    positions=np.array(positions, np.float32),
    faces=faces,
    joints=joints,
    weights=weights,
    rest=np.array(column(geom.getVertexData(), "vertex", point), np.float32),
    matrices=np.array(matrices),
    fps=actor.getFrameRate("walk"),
)
