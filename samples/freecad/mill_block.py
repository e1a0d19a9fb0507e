"""Makes the tool path for the exit face of a block with FreeCAD's Path workbench, without a window.

    freecadcmd -c "exec(open('samples/freecad/mill_block.py').read())"

with these in the environment:
    BLOCK     the STEP file
    GCODE     the file to write (LinuxCNC)
    CUTTER    radius of the ball cutter, mm       [3]
    STEPOVER  from row to row, mm                 [0.3]
    SAMPLE    from point to point of a row, mm    [0.3]
    TOLERANCE the job's tolerance, mm             [0.0001]
    DEFLECTION, ANGLE  of the mesh that the cutter is dropped on, mm and rad  [0.0005, 0.05]
    DECIMALS  of the coordinates                  [4]
    OCL       folder with the Python package opencamlib, if FreeCAD does not find it by itself

Path's 3D surface operation needs OpenCAMLib (pip install opencamlib). Tried with FreeCAD 0.20.
"""
import os
import sys
import time

import FreeCAD
import Import

if os.environ.get("OCL"):
    sys.path.append(os.environ["OCL"])
try:
    import ocl
except ImportError:
    # The package on PyPI has another name than the one that FreeCAD 0.20 asks for.
    from opencamlib import ocl

    sys.modules["ocl"] = ocl

import PathScripts.PathJob as PathJob
import PathScripts.PathSurface as PathSurface
import PathScripts.PathToolBit as PathToolBit
from PathScripts.PathPostProcessor import PostProcessor

BLOCK, GCODE = os.environ["BLOCK"], os.environ["GCODE"]
RADIUS = float(os.environ.get("CUTTER", 3))
STEPOVER = float(os.environ.get("STEPOVER", 0.3))
SAMPLE = float(os.environ.get("SAMPLE", 0.3))
TOLERANCE = float(os.environ.get("TOLERANCE", 0.0001))
DEFLECTION, ANGLE = float(os.environ.get("DEFLECTION", 0.0005)), float(os.environ.get("ANGLE", 0.05))
DECIMALS = int(os.environ.get("DECIMALS", 4))

# 1. File > Import: one solid, in millimetres, named as the design.
start = time.time()
document = FreeCAD.newDocument("block")
Import.insert(BLOCK, document.Name)
body = [o for o in document.Objects if hasattr(o, "Shape") and o.Shape.Solids][0]
assert body.Shape.isValid() and len(body.Shape.Solids) == 1
box = body.Shape.BoundBox
print("BLOCK %s %.4f x %.4f x %.4f mm, %d faces, read in %.1f s" % (
    body.Label, box.XLength, box.YLength, box.ZLength, len(body.Shape.Faces), time.time() - start))

# 2. Path > Job: the stock is the block's own box; nothing is added above, or the first pass cuts air.
job = PathJob.Create("Job", [body], None)
stock = job.Stock
for side in ("ExtXneg", "ExtXpos", "ExtYneg", "ExtYpos", "ExtZneg", "ExtZpos"):
    setattr(stock, side, 0)
# Moves are written at least as finely as the surface is meant.
job.GeometryTolerance = TOLERANCE
job.PostProcessor = "linuxcnc"

# 3. Tool: a ball cutter.
ball = PathToolBit.Factory.CreateFrom(
    os.path.join(FreeCAD.getHomePath(), "Mod/Path/Tools/Bit/6mm_Ball_End.fctb"), "Ball")
ball.Diameter = 2 * RADIUS
controller = job.Tools.Group[0]
controller.Tool = ball
controller.HorizFeed, controller.VertFeed = "20 mm/s", "5 mm/s"
controller.SpindleSpeed = 18000
document.recompute()

# 4. Path > 3D Surface: rows along x, single pass, the depth of the whole face.
start = time.time()
surface = PathSurface.Create("Surface", parentJob=job)
surface.ToolController = controller
surface.ScanType, surface.LayerMode, surface.CutPattern = "Planar", "Single-pass", "ZigZag"
surface.StepOver = 100 * STEPOVER / (2 * RADIUS)
surface.SampleInterval = SAMPLE
surface.BoundBox = "BaseBoundBox"
surface.BoundaryEnforcement = False
# The mesh that OpenCAMLib drops its cutter on: as fine as the job's tolerance.
surface.LinearDeflection, surface.AngularDeflection = DEFLECTION, ANGLE
surface.OptimizeLinearPaths = False
# Beyond the border the cutter would fall to the table: no deeper than the face.
face = [f for f in body.Shape.Faces if type(f.Surface).__name__ == "BSplineSurface"][0]
surface.setExpression("FinalDepth", None)
surface.FinalDepth = face.BoundBox.ZMin
surface.ClearanceHeight.Value = box.ZMax + 5
surface.SafeHeight.Value = box.ZMax + 2
document.recompute()
moves = [c for c in surface.Path.Commands if c.Name in ("G1", "G01")]
depths = [c.Parameters["Z"] for c in moves if "Z" in c.Parameters]
print("PATH %d moves, tip between z = %.4f and z = %.4f, made in %.1f s" % (
    len(moves), min(depths), max(depths), time.time() - start))

# 5. Path > Post process.
post = PostProcessor.load(job.PostProcessor)
post.export([controller, surface], GCODE, "--no-show-editor --precision=%d" % DECIMALS)
print("GCODE %d bytes" % os.path.getsize(GCODE))
