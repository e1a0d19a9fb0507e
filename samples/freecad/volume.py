"""Prints the volume of a round block, by quadrature over the exit face as FreeCAD has it.

    BLOCK=disc.step freecadcmd -c "exec(open('samples/freecad/volume.py').read())"

FreeCAD's own figure, Shape.Volume, takes a fixed number of points for every line across a trimmed face, whatever its number of spans: of
a face with hundreds of them it is off by percents. For blocks with --outline circle, without a rim. Tried with FreeCAD 0.20.
"""
import os
import time

import numpy
import Part

start = time.process_time()
shape = Part.Shape()
shape.read(os.environ["BLOCK"])
print("read in %.1f s of processor time; valid: %s; widest edge tolerance %.0e mm" % (
    time.process_time() - start, shape.isValid(), max(edge.Tolerance for edge in shape.Edges)))
face = [f.Surface for f in shape.Faces if isinstance(f.Surface, Part.BSplineSurface)][0]
entry = [f.Surface.Position.z for f in shape.Faces if isinstance(f.Surface, Part.Plane)][0]
u0, u1, v0, v1 = face.bounds()
low, high = face.value(u0, v0), face.value(u1, v1)
a, b = (high.x - low.x) / 2, (high.y - low.y) / 2
# Gauss points along the angle whose sine is y, and along every chord, on as many intervals as the face has spans.
points, weights = numpy.polynomial.legendre.leggauss(4)
spans = int(os.environ.get("SPANS", 130))
angles = numpy.linspace(-numpy.pi / 2, numpy.pi / 2, spans + 1)
along = (2 * numpy.arange(spans)[:, None] + points + 1).ravel() / spans - 1
share = numpy.tile(weights, spans) / spans
volume = 0.0
for begin, end in zip(angles, angles[1:]):
    for point, weight in zip(points, weights):
        angle = (begin + end) / 2 + point * (end - begin) / 2
        half = a * numpy.cos(angle)
        v = v0 + (v1 - v0) * (1 + numpy.sin(angle)) / 2
        heights = [face.value(u0 + (u1 - u0) * (1 + x * half / a) / 2, v).z - entry for x in along]
        volume += weight * (end - begin) / 2 * b * numpy.cos(angle) * half * float(share @ heights)
print("VOLUME %.6f mm3; Shape.Volume says %.6f mm3" % (volume, shape.Volume), flush=True)
