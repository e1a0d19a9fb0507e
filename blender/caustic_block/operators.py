"""What can be done with a caustic block."""

import os

import bpy
import glasswarp as gw
from bpy.props import BoolProperty, StringProperty

from . import jobs, picture, scene, settings

#: Height nodes across the width of what is shown at once.
FIRST_NODES = 65


class _OnBlock:
    """Operators on the active caustic block."""

    @classmethod
    def poll(cls, context):
        return settings.of(context.object) is not None


class CAUSTICBLOCK_OT_add(bpy.types.Operator):
    """Adds a block of glass whose light draws a picture"""

    bl_idname = "mesh.caustic_block_add"
    bl_label = "Caustic block"
    bl_options = {"REGISTER", "UNDO"}

    image: StringProperty(name="Picture", description="An image that is open in Blender")
    filepath: StringProperty(name="or file", description="A picture file, if no image is named", subtype="FILE_PATH")
    size_mm: bpy.props.FloatProperty(name="Width (mm)", default=100, min=1)
    distance_mm: bpy.props.FloatProperty(name="Distance (mm)", default=250, min=1)
    offset: bpy.props.FloatProperty(name="Offset", default=0.1, min=0, max=1)
    live: BoolProperty(name="Live draft", default=True)
    bench: BoolProperty(name="Bench", description="Adds lamp, receiver, frame and camera", default=True)
    cycles: BoolProperty(name="Set up Cycles", description="Sets the scene to render the caustic", default=True)

    def invoke(self, context, _event):
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, _context):
        layout = self.layout
        layout.use_property_split = True
        layout.prop_search(self, "image", bpy.data, "images")
        if not self.image:
            layout.prop(self, "filepath")
        for name in ("size_mm", "distance_mm", "offset", "live", "bench", "cycles"):
            layout.prop(self, name)

    def execute(self, context):
        if context.mode != "OBJECT":
            self.report({"ERROR"}, "a block is added in object mode")
            return {"CANCELLED"}
        before = set(bpy.data.images)
        thing = None
        try:
            image = self._image()
            thing = scene.new_block(context)
            wanted = settings.of(thing)
            wanted.live = False
            wanted.image = image
            for name in ("size_mm", "distance_mm", "offset"):
                setattr(wanted, name, getattr(self, name))
            job = jobs.Job(thing, draft=True)
            job.keywords["nodes"] = min(FIRST_NODES, wanted.draft_nodes)
            job.make()
        except (gw.GlasswarpError, picture.NoPicture, ValueError, OSError) as error:
            if thing is not None:
                scene.remove(thing)
            for image in set(bpy.data.images) - before:
                bpy.data.images.remove(image)
            self.report({"ERROR"}, jobs.said(error))
            return {"CANCELLED"}
        jobs.take(thing, job)
        # It is coarser than a draft.
        settings.set_shown(thing, "")
        wanted.live = self.live
        if self.bench:
            scene.add_bench(thing)
        if self.cycles:
            scene.set_up_cycles(context.scene, thing)
        for other in context.selected_objects:
            other.select_set(False)
        thing.select_set(True)
        context.view_layer.objects.active = thing
        return {"FINISHED"}

    def _image(self):
        if self.image:
            found = bpy.data.images.get(self.image)
            if found is None:
                raise picture.NoPicture(f"there is no image '{self.image}'")
            return found
        if not self.filepath:
            raise picture.NoPicture("there is no picture: name an image or a file")
        # A path relative to the working folder would be lost with the .blend in another.
        path = os.path.abspath(bpy.path.abspath(self.filepath))
        if not os.path.isfile(path):
            raise picture.NoPicture(f"the picture is not there: {path}")
        return bpy.data.images.load(path, check_existing=True)


class _Waits(_OnBlock):
    """Operators that wait for a solve: in windows through a timer, in the background at once."""

    def begin(self, context):
        self.thing = context.object
        try:
            self.job = jobs.start(self.thing, draft=False)
        except picture.NoPicture as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if bpy.app.background:
            jobs.wait(self.job)
            return self.end(context)
        self.timer = context.window_manager.event_timer_add(jobs.TICK, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "TIMER":
            jobs.pump()
            if self.job not in jobs.going_on():
                context.window_manager.event_timer_remove(self.timer)
                return self.end(context)
        return {"PASS_THROUGH"}

    def end(self, context):
        if self.job.cancelled or isinstance(self.job.error, jobs.Cancelled):
            self.report({"WARNING"}, "cancelled, or settings were changed meanwhile: what was there before stays")
            return {"CANCELLED"}
        if self.job.error is not None:
            self.report({"ERROR"}, jobs.said(self.job.error))
            return {"CANCELLED"}
        for text in self.job.said:
            self.report({"WARNING"}, text)
        return self.finish(context)


class CAUSTICBLOCK_OT_solve(_Waits, bpy.types.Operator):
    """Solves for the block with all its nodes, in the background"""

    bl_idname = "object.caustic_block_solve"
    bl_label = "Solve"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        return self.begin(context)

    def finish(self, _context):
        size = self.job.block.size
        self.report({"INFO"}, f"{size.nodes[0]} x {size.nodes[1]} nodes in {self.job.block.summary.seconds:.1f} s")
        return {"FINISHED"}


class CAUSTICBLOCK_OT_cancel(_OnBlock, bpy.types.Operator):
    """Ends what is being computed for the block; what it shows stays"""

    bl_idname = "object.caustic_block_cancel"
    bl_label = "Cancel"

    def execute(self, context):
        jobs.cancel(context.object)
        return {"FINISHED"}


class CAUSTICBLOCK_OT_bench(_OnBlock, bpy.types.Operator):
    """Adds what is missing of lamp, receiver, frame and camera, and puts all of it where it belongs"""

    bl_idname = "object.caustic_block_bench"
    bl_label = "Bench"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        scene.add_bench(context.object)
        return {"FINISHED"}


class CAUSTICBLOCK_OT_cycles(_OnBlock, bpy.types.Operator):
    """Sets the scene to render the caustic with Cycles, seen by the camera of the block's bench"""

    bl_idname = "object.caustic_block_cycles"
    bl_label = "Set up Cycles"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        scene.set_up_cycles(context.scene, context.object)
        return {"FINISHED"}


_CLASSES = (
    CAUSTICBLOCK_OT_add,
    CAUSTICBLOCK_OT_solve,
    CAUSTICBLOCK_OT_cancel,
    CAUSTICBLOCK_OT_bench,
    CAUSTICBLOCK_OT_cycles,
)


def _in_menu(menu, _context):
    menu.layout.operator(CAUSTICBLOCK_OT_add.bl_idname, icon="MESH_PLANE")


def register():
    for each in _CLASSES:
        bpy.utils.register_class(each)
    bpy.types.VIEW3D_MT_mesh_add.append(_in_menu)


def unregister():
    bpy.types.VIEW3D_MT_mesh_add.remove(_in_menu)
    for each in reversed(_CLASSES):
        bpy.utils.unregister_class(each)
