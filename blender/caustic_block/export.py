"""*File > Export > Caustic block*: files written by glasswarp, exact and with a side file."""

import os

import bpy
import glasswarp as gw
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from . import jobs, picture
from .operators import _Waits

FORMATS = [
    (".stl", "STL", "Triangles, for printers and CAM"),
    (".step", "STEP", "A B-spline face, for CAD and CAM"),
    (".3mf", "3MF", "Triangles with their unit"),
    (".obj", "OBJ", "Triangles with normals"),
    (".ply", "PLY", "Triangles with normals"),
    (".glb", "glTF", "Triangles with normals and material, in metres"),
    (".exr", "Heights (EXR)", "A map of heights, mm"),
    (".png", "Heights (PNG)", "A map of heights, 16 bits"),
]


class CAUSTICBLOCK_OT_export(_Waits, bpy.types.Operator, ExportHelper):
    """Writes the block as glasswarp does: exact, with a side file that remembers its bench"""

    bl_idname = "export_mesh.caustic_block"
    bl_label = "Export caustic block"
    # glasswarp itself knows which files are its own.
    check_extension = None

    filename_ext = ".stl"
    filter_glob: StringProperty(default=";".join(f"*{one[0]}" for one in FORMATS), options={"HIDDEN"})
    format: EnumProperty(name="Format", items=FORMATS, description="Of a name without an extension", default=".stl")
    force: BoolProperty(
        name="Replace others' files",
        description="Replaces files that glasswarp did not write, or that were changed since; never a picture that the block is made of",
    )

    def invoke(self, context, event):
        if not self.filepath:
            folder = os.path.dirname(bpy.data.filepath)
            self.filepath = os.path.join(folder, bpy.path.clean_name(context.object.name).lower() + self.format)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        self.path = bpy.path.abspath(self.filepath)
        if not os.path.splitext(self.path)[1]:
            self.path += self.format
        try:
            block = jobs.solved(context.object)
        except picture.NoPicture as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return self.begin(context) if block is None else self.write(block)

    def finish(self, _context):
        return self.write(self.job.block)

    def write(self, block):
        try:
            said = block.save(self.path, force=self.force)
        except (gw.GlasswarpError, OSError) as error:
            self.report({"ERROR"}, jobs.said(error))
            return {"CANCELLED"}
        for text in said:
            self.report({"INFO"}, text)
        nx, ny = block.size.nodes
        self.report({"INFO"}, f"{self.path} written, {nx} x {ny} nodes")
        return {"FINISHED"}


def _in_menu(menu, _context):
    menu.layout.operator(CAUSTICBLOCK_OT_export.bl_idname, text="Caustic block (.stl, .step, .3mf, ...)")


def register():
    bpy.utils.register_class(CAUSTICBLOCK_OT_export)
    bpy.types.TOPBAR_MT_file_export.append(_in_menu)


def unregister():
    bpy.types.TOPBAR_MT_file_export.remove(_in_menu)
    bpy.utils.unregister_class(CAUSTICBLOCK_OT_export)
