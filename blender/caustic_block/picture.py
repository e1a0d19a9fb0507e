"""The picture of a block: an image of Blender, as glasswarp takes it."""

import hashlib
import os

import bpy
import numpy as np

#: Colour spaces of images that are kept in the .blend, and whether their numbers are light already.
LINEAR = {
    "sRGB": False,
    "Linear": True,
    "Linear Rec.709": True,
    "Non-Color": True,
    "Raw": True,
}


class NoPicture(Exception):
    """An image that glasswarp cannot take, and why."""


def file_of(image):
    """The file of an image that is as its file is; `None` if it is only in Blender: painted on, generated, or packed."""
    if image.source not in {"FILE", "GENERATED"}:
        raise NoPicture(f"'{image.name}' is a {image.source.lower()} image: take a single still picture")
    if image.source == "GENERATED" or image.is_dirty or image.packed_file is not None:
        return None
    path = os.path.abspath(bpy.path.abspath(image.filepath_from_user(), library=image.library))
    if not os.path.isfile(path):
        raise NoPicture(f"the file of '{image.name}' is not there: {path}")
    return path


def identity(image):
    """A text that changes when the picture does."""
    path = file_of(image)
    if path is not None:
        found = os.stat(path)
        return f"{path} {found.st_size} {found.st_mtime_ns}"
    light = _light(image)
    return f"{light.shape} {hashlib.sha256(light.tobytes()).hexdigest()}"


def taken(image):
    """The picture as `glasswarp.design` takes it: a path, or an array of light with its top row first."""
    path = file_of(image)
    return _light(image) if path is None else path


def _light(image):
    """Luminance of the pixels, linear, on black."""
    space = image.colorspace_settings.name
    if space not in LINEAR:
        raise NoPicture(f"the colour space '{space}' of '{image.name}' is not known here: take one of {', '.join(LINEAR)}")
    width, height = image.size
    if width < 2 or height < 2:
        raise NoPicture(f"'{image.name}' has no pixels")
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, image.channels)[::-1].astype(np.float64)
    alpha = pixels[..., 3] if image.channels == 4 and image.alpha_mode != "NONE" else 1.0
    colours = pixels[..., :3]
    # Pixels of floats are in linear light, whatever their file was; bytes are as they are stored.
    if not image.is_float and not LINEAR[space]:
        colours = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    light = colours @ (0.2126, 0.7152, 0.0722) if colours.shape[2] == 3 else colours[..., 0]
    # Floats have their alpha multiplied in.
    return light if image.is_float else light * alpha
