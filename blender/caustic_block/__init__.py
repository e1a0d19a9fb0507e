"""Blocks of glass whose light draws a picture, in Blender: *Add > Mesh > Caustic block*.

The face is computed by glasswarp, which comes along as a wheel, and files are written by it. `library` finds it; `settings` are kept on
the object; `jobs` compute in threads, and `scene` puts what they made into the file.
"""

bl_info = {
    "name": "Caustic block",
    "description": "Blocks of glass whose light draws a picture",
    "author": "glasswarp",
    "version": (0, 0, 0),
    "blender": (3, 4, 0),
    "location": "Add > Mesh > Caustic block; sidebar of the 3D view > Caustic",
    "category": "Add Mesh",
}


def register():
    # An older Blender has no wheels of add-ons: glasswarp has to be there before anything else is imported.
    from . import library

    library.load()
    from . import export, jobs, operators, panel, settings

    for module in (settings, operators, export, panel, jobs):
        module.register()


def unregister():
    from . import export, jobs, operators, panel, settings

    for module in (jobs, panel, export, operators, settings):
        module.unregister()
