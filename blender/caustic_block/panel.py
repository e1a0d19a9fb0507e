"""The panels of a caustic block, in the sidebar of the 3D view."""

import bpy

from . import jobs, scene, settings

#: Of a character, and of what stands beside a line in the sidebar, pixels at a scale of 1.
CHARACTER, BESIDE = 6.5, 75


class _Panel:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Caustic"


class CAUSTICBLOCK_PT_block(_Panel, bpy.types.Panel):
    bl_label = "Caustic block"

    def draw(self, context):
        layout = self.layout
        wanted = settings.of(context.object)
        if wanted is None:
            layout.label(text="Select a caustic block, or add one")
            layout.operator("mesh.caustic_block_add", icon="ADD")
            return
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.template_ID(wanted, "image", open="image.open")
        column = layout.column(align=True)
        column.prop(wanted, "nodes")
        job = jobs.job_of(context.object)
        if job is None or job.draft:
            layout.operator("object.caustic_block_solve", icon="PLAY")
        if job is not None:
            row = layout.row(align=True)
            row.label(text=f"{'Draft' if job.draft else 'Solve'}: {job.stage} {100 * job.progress:.0f} %", icon="SORTTIME")
            row.operator("object.caustic_block_cancel", text="", icon="X")
        layout.operator("export_mesh.caustic_block", text="Export", icon="EXPORT")
        _lines(layout, wanted.fault, "ERROR")
        if job is None and not settings.fits(context.object):
            _lines(layout, "The face is not that of these settings", "ERROR")
        if wanted.bench and not scene.fits_cycles(context.object):
            _lines(layout, "Cycles loses light at this scale: see Set up Cycles", "ERROR")
        if wanted.shown_nodes:
            _lines(layout, f"{wanted.shown_nodes} nodes across, {_kind(context.object)}\n{wanted.about}", "INFO")


def _kind(thing):
    shown = settings.shown(thing)
    if not shown:
        return "coarse"
    return "draft" if '"quality": "draft"' in shown else "solved"


def _lines(layout, text, icon):
    """A text over as many lines as it takes."""
    column = layout.column(align=True)
    column.scale_y = 0.8
    context = bpy.context
    width = (context.region.width / context.preferences.system.ui_scale - BESIDE) / CHARACTER
    for paragraph in filter(None, text.split("\n")):
        line = ""
        for word in paragraph.split():
            if line and len(line) + len(word) >= width:
                column.label(text=line, icon=icon)
                line, icon = "", "BLANK1"
            line = f"{line} {word}".strip()
        column.label(text=line, icon=icon)
        icon = "BLANK1"


class _Part(_Panel):
    bl_parent_id = "CAUSTICBLOCK_PT_block"

    @classmethod
    def poll(cls, context):
        return settings.of(context.object) is not None

    def draw(self, context):
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        self.fill(self.layout.column(), settings.of(context.object))


class CAUSTICBLOCK_PT_glass(_Part, bpy.types.Panel):
    bl_label = "Block"

    def fill(self, column, wanted):
        for name in ("size_mm", "thickness_mm", "material", "ior"):
            column.prop(wanted, name)


class CAUSTICBLOCK_PT_picture(_Part, bpy.types.Panel):
    bl_label = "Picture"

    def fill(self, column, wanted):
        for name in ("distance_mm", "window_mm", "shift_mm", "offset", "margin", "transfer"):
            column.prop(wanted, name)


class CAUSTICBLOCK_PT_light(_Part, bpy.types.Panel):
    bl_label = "Light"

    def fill(self, column, wanted):
        column.prop(wanted, "light")
        if wanted.light == "point":
            column.prop(wanted, "source_distance_mm")
        for name in ("source_size", "tilt", "tilt_from", "brightness"):
            column.prop(wanted, name)


class CAUSTICBLOCK_PT_draft(_Part, bpy.types.Panel):
    bl_label = "Draft and scene"

    def fill(self, column, wanted):
        column.prop(wanted, "live")
        column.prop(wanted, "draft_nodes")
        column.operator("object.caustic_block_bench", icon="OUTLINER_OB_LIGHT")
        column.operator("object.caustic_block_cycles", icon="SCENE")


_CLASSES = (
    CAUSTICBLOCK_PT_block,
    CAUSTICBLOCK_PT_glass,
    CAUSTICBLOCK_PT_picture,
    CAUSTICBLOCK_PT_light,
    CAUSTICBLOCK_PT_draft,
)


def register():
    for each in _CLASSES:
        bpy.utils.register_class(each)


def unregister():
    for each in reversed(_CLASSES):
        bpy.utils.unregister_class(each)
