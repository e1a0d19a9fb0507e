"""What is asked of a block, kept on its object."""

import json
import math
import uuid

import bpy
import glasswarp as gw
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from . import picture

#: Of the mesh.
_SHOWN = "caustic_block_shown"


def _changed(settings, _context):
    from . import jobs

    if settings.live:
        jobs.touch(settings.id_data)


def _lit(settings, _context):
    from . import scene

    scene.relight(settings.id_data)


def _materials(_settings, _context, edit_text):
    return [one.name for one in gw.materials().materials if edit_text.lower() in one.name]


class CausticBlockSettings(bpy.types.PropertyGroup):
    """Settings of glasswarp by their names there. 0 and nothing leave it to glasswarp."""

    uid: StringProperty(options={"HIDDEN"})
    image: PointerProperty(name="Picture", description="What the light shall draw", type=bpy.types.Image, update=_changed)
    transfer: EnumProperty(
        name="Numbers",
        description="How numbers in the picture's file become light",
        items=[
            ("AUTO", "As the file says", "As its profile says, else sRGB; floats are linear"),
            ("srgb", "sRGB", "sRGB, whatever the file says"),
            ("linear", "Linear", "Numbers are light"),
        ],
        update=_changed,
    )
    size_mm: FloatProperty(
        name="Width", description="Width of the block, mm", default=100, min=1, soft_max=1000, update=_changed
    )
    thickness_mm: FloatProperty(
        name="Thickness",
        description="From the entry face to the highest point of the exit face, mm; 0: by the sheet",
        min=0,
        soft_max=100,
        update=_changed,
    )
    distance_mm: FloatProperty(
        name="Distance",
        description="From the mean plane of the exit face to the receiver, mm",
        default=250,
        min=1,
        soft_max=5000,
        update=_changed,
    )
    window_mm: FloatProperty(
        name="Picture width",
        description="Width of the picture on the receiver, mm; 0: as the light, for parallel light as the block",
        min=0,
        soft_max=5000,
        update=_changed,
    )
    shift_mm: FloatVectorProperty(
        name="Shift",
        description="Moves the picture on the receiver to the right and up, as seen from the block, mm",
        size=2,
        update=_changed,
    )
    material: StringProperty(
        name="Material", description="What the block is made of", default="pmma", search=_materials, update=_changed
    )
    ior: FloatProperty(
        name="Index", description="Refractive index; 0: that of the material", min=0, max=3, precision=4, update=_changed
    )
    light: EnumProperty(
        name="Light",
        items=[
            ("parallel", "Parallel", "From far away: the sun, a collimated lamp"),
            ("point", "Point", "A small lamp nearby that shines the same in all directions"),
        ],
        update=_changed,
    )
    tilt: FloatProperty(
        name="Tilt",
        description="Angle of the light to the axis of the block",
        subtype="ANGLE",
        min=0,
        soft_max=math.radians(60),
        update=_changed,
    )
    tilt_from: FloatProperty(
        name="From",
        description="Where it comes from: 0 from the picture's top, 90 degrees from its right, 180 from its bottom",
        subtype="ANGLE",
        min=0,
        max=2 * math.pi,
        update=_changed,
    )
    source_distance_mm: FloatProperty(
        name="Lamp distance",
        description="From a point source to the middle of the entry face, mm",
        default=500,
        min=1,
        soft_max=5000,
        update=_changed,
    )
    source_size: StringProperty(
        name="Lamp size",
        description="Size of the light, whose blur is corrected for: sun, 0.5deg, 5mm, or none; empty: it is not said",
        update=_changed,
    )
    offset: FloatProperty(
        name="Offset",
        description="Constant added to the light of the picture: it trades contrast for gentler slopes",
        default=0.1,
        min=0,
        max=1,
        update=_changed,
    )
    margin: FloatProperty(
        name="Margin",
        description="Part of the window that stays dark on every side of the picture",
        min=0,
        max=0.45,
        update=_changed,
    )
    nodes: IntProperty(name="Nodes", description="Height nodes across the width, solved for", default=641, min=17, max=4097)
    draft_nodes: IntProperty(
        name="Draft nodes",
        description="Height nodes across the width of a draft",
        default=129,
        min=17,
        max=513,
        update=_changed,
    )
    live: BoolProperty(
        name="Live draft",
        description="Makes a draft again a moment after a setting was changed",
        default=True,
        update=_changed,
    )
    brightness: FloatProperty(
        name="Brightness",
        description="Light where the picture is brightest, before losses in the glass; 1 is white",
        default=1,
        min=0,
        soft_max=10,
        update=_lit,
    )

    # What was made of them.
    shown_nodes: IntProperty(options={"HIDDEN"})
    about: StringProperty(options={"HIDDEN"})
    fault: StringProperty(options={"HIDDEN"})
    bench: StringProperty(options={"HIDDEN"})
    per_mm: FloatProperty(default=0.001, options={"HIDDEN"})
    glass: PointerProperty(type=bpy.types.Material, options={"HIDDEN"})
    lamp: PointerProperty(type=bpy.types.Object, options={"HIDDEN"})
    receiver: PointerProperty(type=bpy.types.Object, options={"HIDDEN"})
    frame: PointerProperty(type=bpy.types.Object, options={"HIDDEN"})
    camera: PointerProperty(type=bpy.types.Object, options={"HIDDEN"})


def of(thing):
    """The settings of an object that is a caustic block, else `None`."""
    settings = getattr(thing, "caustic_block", None)
    return settings if settings is not None and settings.uid and thing.type == "MESH" else None


def shown(thing):
    """What was asked for of the face that a block has; nothing, if that is coarser than a draft. The mesh itself says it, because undo may
    take an object back without its mesh."""
    return thing.data.get(_SHOWN, "")


def set_shown(thing, request):
    thing.data[_SHOWN] = request


def fits(thing):
    """Whether the face is that of the settings, as far as can be told without the picture."""
    wanted = of(thing)
    if wanted.image is None:
        return False
    try:
        return shown(thing) != "" and json.loads(shown(thing))[0] in (keywords(wanted, False), keywords(wanted, True))
    except picture.NoPicture:
        return False


def blocks():
    """All caustic blocks of the file."""
    return [thing for thing in bpy.data.objects if of(thing) is not None]


def own(thing):
    """Gives an object that was duplicated a name of its own among the blocks, and takes the other's bench from it."""
    wanted = of(thing)
    if any(of(other).uid == wanted.uid for other in blocks() if other != thing):
        begin(thing)
        wanted.glass = None
        for role in ("lamp", "receiver", "frame", "camera"):
            part = getattr(wanted, role)
            if part is not None and part.parent != thing:
                setattr(wanted, role, None)


def begin(thing):
    """Makes an object a caustic block."""
    thing.caustic_block.uid = uuid.uuid4().hex


def exact(value):
    """The number that was typed: Blender keeps it in single precision, where 0.1 is 0.10000000149."""
    return float(f"{value:.7g}")


def keywords(settings, draft):
    """The settings as `glasswarp.design` takes them."""
    given = {
        "size_mm": exact(settings.size_mm),
        "distance_mm": exact(settings.distance_mm),
        "material": settings.material,
        "offset": exact(settings.offset),
        "light": settings.light,
        "nodes": settings.draft_nodes if draft else settings.nodes,
    }
    if draft:
        given["quality"] = "draft"
    for name in ("thickness_mm", "window_mm", "ior", "margin"):
        if getattr(settings, name) > 0:
            given[name] = exact(getattr(settings, name))
    if any(settings.shift_mm):
        given["shift_mm"] = list(map(exact, settings.shift_mm))
    if settings.transfer != "AUTO" and picture.file_of(settings.image) is not None:
        given["transfer"] = settings.transfer
    if settings.tilt > 0:
        given["tilt_deg"] = [exact(math.degrees(angle)) for angle in (settings.tilt, settings.tilt_from)]
    if settings.light == "point":
        given["source_distance_mm"] = exact(settings.source_distance_mm)
    if settings.source_size:
        given["source_size"] = settings.source_size
    return given


def request(settings, draft):
    """A text that says what is asked; it is another one if a setting or the picture is."""
    if settings.image is None:
        raise picture.NoPicture("there is no picture: choose one")
    return json.dumps([keywords(settings, draft), picture.identity(settings.image)], sort_keys=True)


def register():
    bpy.utils.register_class(CausticBlockSettings)
    bpy.types.Object.caustic_block = PointerProperty(type=CausticBlockSettings)


def unregister():
    del bpy.types.Object.caustic_block
    bpy.utils.unregister_class(CausticBlockSettings)
