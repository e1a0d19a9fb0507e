"""The keywords of every call, for type checkers and readers. Made by generate.py."""

from __future__ import annotations

import os
from typing import Literal, Sequence, TypedDict, Union

#: A path.
Path = Union[str, os.PathLike[str]]
#: A value as the command line takes it: text with a unit, or a number.
Text = Union[str, float, tuple[float, ...]]
#: A number in the unit of the keyword, or several where the value has several.
Numbers = Union[float, tuple[float, ...]]


class Settings(TypedDict, total=False):
    """Everything that shapes a block."""

    #: A common set-up to start from ('glasswarp presets') Its settings hold where neither a flag nor the design file
    #: says otherwise.
    preset: Literal['sunlit-window', 'torch-on-table', 'desk-demo', 'wall-mirror']
    #: Width of the block [default: 100mm] Its height follows the picture's aspect.
    size_mm: Numbers
    size: Text
    #: From the curved face to the receiver [default: 250mm] Counted from the mean plane of the exit face, along the
    #: axis.
    distance_mm: Numbers
    distance: Text
    #: Width of the picture on the receiver, centred where the light of a flat block falls; its height follows the
    #: picture's aspect [default: as that light: for parallel light as the block]
    window_mm: Numbers
    window: Text
    #: Move the picture on the receiver to the right and up, as seen from the block: 25mm,10mm
    shift_mm: Numbers
    shift: Text
    #: Let the receiver lean: 20deg takes the picture's top further away, 20deg,90deg its right side (180 bottom, 270
    #: left). The picture is undistorted on it; the distance is that along the axis
    receiver_tilt_deg: Numbers
    receiver_tilt: Text
    #: The face is a mirror, lit from the receiver's side
    mirror: bool
    #: What light there is: parallel (from far away: the sun, a collimated lamp), or point (a torch, an LED, a candle)
    #: [default: parallel; point, if a distance or emission of a source is given]
    light: Text
    #: Let the light come from above: 30deg, or a side: 30deg,90deg The angle to the axis of the block, and from
    #: where: without a side from the picture's top, 90deg from its right, 180deg from its bottom, 270deg from its
    #: left [default: straight]
    tilt_deg: Numbers
    tilt: Text
    #: From a point source to the middle of the entry face, or of the mirror [default: 500mm]
    source_distance_mm: Numbers
    source_distance: Text
    #: How a point source shines, aimed at the middle of the block: isotropic, lambertian, gaussian:12deg (half as
    #: bright there), or an IES file (.ies) [default: isotropic]
    emission: Text
    #: A linear picture of the light on the entry face, or on the mirror, from edge to edge of the block and the same
    #: way round as the picture on the receiver: its unevenness is corrected for
    beam: Path
    #: Let the block stand behind another one, in the light that comes through it: its file, its side file beside it,
    #: and the air from its mean exit plane to the entry face: plate.stl,30mm
    behind: Text
    #: Refractive index of the block [default: that of its material]
    ior: float
    #: Wavelength that the block is designed for, 400nm to 700nm: that of a laser or a coloured LED [default: 587.6nm,
    #: for which catalogues give the index]
    wavelength_nm: Numbers
    wavelength: Text
    #: Material: pmma, bk7, ... ('glasswarp materials') [default: pmma] Cast acrylic unless something else is said;
    #: the index may be told by ior instead.
    material: Text
    #: Thickness of the block [default: by the sheet] From the entry face to the highest point of the exit face; by
    #: default that of the thinnest standard sheet that holds the relief, less facing_mm.
    thickness_mm: Numbers
    thickness: Text
    #: What is faced off the top of the sheet before the face is cut, because no sheet is as thick as its name: the
    #: sheet to order is that much thicker than the block [default: 0.5mm]
    facing_mm: Numbers
    facing: Text
    #: Least thickness that the block may have anywhere [default: 3mm]
    min_thickness_mm: Numbers
    min_thickness: Text
    #: Size of the light: sun, 0.5deg, 5mm, or none for a laser Its spread is corrected for: sun or 0.53deg for
    #: parallel light; 5mm (a disc) or 5x3mm for a point source; none for a laser, and for what else spreads nothing.
    source_size: Text
    #: Roughness of the exit face, corrected for: the standard deviation of its slope along any direction, as an
    #: angle: 0.1deg
    roughness: Text
    #: What else spreads the light, corrected for: a linear picture of the speck that a laser through the block makes
    #: on the receiver, seen as the picture is, and the size of its pixels there: speck.png,0.05mm
    psf: Text
    #: How spread light is corrected for [default: window]
    deconvolution: Literal['window', 'paper', 'off']
    #: Rounds of the deconvolution, at most: fewer leave more blur and less ringing [default: 60]
    deconvolution_rounds: int
    #: Draw the picture where this mesh of m x n quads lies on the receiver, folds and all: an .obj in mm, whose first
    #: face begins with the vertex for the block's corner of least x and y, and goes on along +x (warping solvers)
    caustic_mesh: Path
    #: Let the exit face go on beyond the picture's light by this much, so that light from the side enters through the
    #: entry face [default: as much as the light needs]
    skirt_mm: Numbers
    skirt: Text
    #: Outline of the block: rectangle, circle (the ellipse within its size), or rounded:10mm (radius of the corners);
    #: the picture stays whole [default: rectangle]
    outline: Text
    #: Height nodes across the width of a rectangle; a face of another outline has as many in all [default: two per
    #: pixel, 257 to 1025]
    nodes: int
    #: A rim or flange around the face: 10mm,2mm or 10mm,-4mm WIDTH,HEIGHT: its plane lies HEIGHT above the highest
    #: point of the face; negative: a flange below the face, to clamp the block by [default: none]
    rim_mm: Numbers
    rim: Text
    #: Registration mark: cut this length off the rim's corner at the picture's top left (+x, +y)
    mark_mm: Numbers
    mark: Text
    #: Where the coordinates of the files are counted from [default: exit]
    origin: Literal['exit', 'entry', 'stock-top', 'corner']
    #: Greatest distance of a STEP file's B-spline face from the height field, such as 0.05um [default: as near as the
    #: picture needs]
    step_tolerance_um: Numbers
    step_tolerance: Text
    #: Constant added to the light of the picture (0..1): it trades contrast for gentler slopes [default: 0.1]
    offset: float
    #: Part of the window that stays dark on every side of the picture, 0 to 0.45 [default: 0]
    margin: float
    #: Darken the picture towards its border: none, circle (dark outside of the ellipse within it), or circle:0.2
    #: (fading over this share of the radius) [default: none]
    vignette: Text
    #: How numbers in the picture become light, whatever its file says [default: as its profile or chunks say, else
    #: srgb; floats and OpenEXR linear]
    transfer: Literal['srgb', 'linear']
    #: Light behind the transparent parts of the picture: black, white or #rrggbb [default: black; white for SVG]
    background: Text
    #: The layer of an OpenEXR picture, or a single channel of it [default: the only one with colours]
    layer: Text
    #: Use a part of the picture: 100,50,640,480 or 10%,0%,80%,100% Of the upright picture, counted from its top left
    #: corner, in pixels or per cent.
    crop: Text
    #: Turn the picture clockwise: 90deg, 180deg or 270deg
    rotate: Text
    #: Mirror the picture: horizontal (left and right change places) or vertical
    flip: Text
    #: What becomes black and what white, 0 to 1 as image editors count, and the gamma in between: 0.1,0.9 or
    #: 0.05,0.8,1.2
    levels: Text
    #: Let dark and light change places
    invert: bool
    #: How the surface is found [default: transport]
    solver: Literal['transport', 'warping', 'warping-paper']
    #: How much work the transport solver puts in [default: normal]
    quality: Literal['draft', 'normal', 'fine']
    #: Bound the curvature of the face for a cutter of this radius, at some cost in accuracy (transport solver)
    min_radius_mm: Numbers
    min_radius: Text
    #: Make a face that is right after its polish: polish=0.1mm A polish that blurs heights with this standard
    #: deviation; also polish=0.1mm,cutter=ball:d6mm,step-over=0.1mm, and gain=6 limits how much any wave is amplified
    #: for it (transport solver).
    finish: Text


class DesignOptions(Settings, total=False):
    """The keywords of design."""

    #: Take more memory than this machine has free, if it must be
    ignore_memory: bool


class PreviewOptions(TypedDict, total=False):
    """The keywords of preview: `glasswarp preview`."""

    #: Where to: .html (the page to turn the block on) or .png (target, light and difference). May be given several
    #: times [default: the picture's name with .preview.html, in the working folder]
    output: Union[Path, Sequence[Path]]
    #: Take more memory than this machine has free, if it must be
    ignore_memory: bool
    #: A common set-up to start from ('glasswarp presets') Its settings hold where neither a flag nor the design file
    #: says otherwise.
    preset: Literal['sunlit-window', 'torch-on-table', 'desk-demo', 'wall-mirror']
    #: Width of the block [default: 100mm] Its height follows the picture's aspect.
    size_mm: Numbers
    size: Text
    #: From the curved face to the receiver [default: 250mm] Counted from the mean plane of the exit face, along the
    #: axis.
    distance_mm: Numbers
    distance: Text
    #: Width of the picture on the receiver, centred where the light of a flat block falls; its height follows the
    #: picture's aspect [default: as that light: for parallel light as the block]
    window_mm: Numbers
    window: Text
    #: Move the picture on the receiver to the right and up, as seen from the block: 25mm,10mm
    shift_mm: Numbers
    shift: Text
    #: Let the receiver lean: 20deg takes the picture's top further away, 20deg,90deg its right side (180 bottom, 270
    #: left). The picture is undistorted on it; the distance is that along the axis
    receiver_tilt_deg: Numbers
    receiver_tilt: Text
    #: The face is a mirror, lit from the receiver's side
    mirror: bool
    #: What light there is: parallel (from far away: the sun, a collimated lamp), or point (a torch, an LED, a candle)
    #: [default: parallel; point, if a distance or emission of a source is given]
    light: Text
    #: Let the light come from above: 30deg, or a side: 30deg,90deg The angle to the axis of the block, and from
    #: where: without a side from the picture's top, 90deg from its right, 180deg from its bottom, 270deg from its
    #: left [default: straight]
    tilt_deg: Numbers
    tilt: Text
    #: From a point source to the middle of the entry face, or of the mirror [default: 500mm]
    source_distance_mm: Numbers
    source_distance: Text
    #: How a point source shines, aimed at the middle of the block: isotropic, lambertian, gaussian:12deg (half as
    #: bright there), or an IES file (.ies) [default: isotropic]
    emission: Text
    #: A linear picture of the light on the entry face, or on the mirror, from edge to edge of the block and the same
    #: way round as the picture on the receiver: its unevenness is corrected for
    beam: Path
    #: Let the block stand behind another one, in the light that comes through it: its file, its side file beside it,
    #: and the air from its mean exit plane to the entry face: plate.stl,30mm
    behind: Text
    #: Refractive index of the block [default: that of its material]
    ior: float
    #: Wavelength that the block is designed for, 400nm to 700nm: that of a laser or a coloured LED [default: 587.6nm,
    #: for which catalogues give the index]
    wavelength_nm: Numbers
    wavelength: Text
    #: Material: pmma, bk7, ... ('glasswarp materials') [default: pmma] Cast acrylic unless something else is said;
    #: the index may be told by ior instead.
    material: Text
    #: Thickness of the block [default: by the sheet] From the entry face to the highest point of the exit face; by
    #: default that of the thinnest standard sheet that holds the relief, less facing_mm.
    thickness_mm: Numbers
    thickness: Text
    #: What is faced off the top of the sheet before the face is cut, because no sheet is as thick as its name: the
    #: sheet to order is that much thicker than the block [default: 0.5mm]
    facing_mm: Numbers
    facing: Text
    #: Least thickness that the block may have anywhere [default: 3mm]
    min_thickness_mm: Numbers
    min_thickness: Text
    #: Size of the light: sun, 0.5deg, 5mm, or none for a laser Its spread is corrected for: sun or 0.53deg for
    #: parallel light; 5mm (a disc) or 5x3mm for a point source; none for a laser, and for what else spreads nothing.
    source_size: Text
    #: Roughness of the exit face, corrected for: the standard deviation of its slope along any direction, as an
    #: angle: 0.1deg
    roughness: Text
    #: What else spreads the light, corrected for: a linear picture of the speck that a laser through the block makes
    #: on the receiver, seen as the picture is, and the size of its pixels there: speck.png,0.05mm
    psf: Text
    #: How spread light is corrected for [default: window]
    deconvolution: Literal['window', 'paper', 'off']
    #: Rounds of the deconvolution, at most: fewer leave more blur and less ringing [default: 60]
    deconvolution_rounds: int
    #: Draw the picture where this mesh of m x n quads lies on the receiver, folds and all: an .obj in mm, whose first
    #: face begins with the vertex for the block's corner of least x and y, and goes on along +x (warping solvers)
    caustic_mesh: Path
    #: Let the exit face go on beyond the picture's light by this much, so that light from the side enters through the
    #: entry face [default: as much as the light needs]
    skirt_mm: Numbers
    skirt: Text
    #: Outline of the block: rectangle, circle (the ellipse within its size), or rounded:10mm (radius of the corners);
    #: the picture stays whole [default: rectangle]
    outline: Text
    #: Height nodes across the width of a rectangle; a face of another outline has as many in all [default: two per
    #: pixel, 257 to 1025]
    nodes: int
    #: A rim or flange around the face: 10mm,2mm or 10mm,-4mm WIDTH,HEIGHT: its plane lies HEIGHT above the highest
    #: point of the face; negative: a flange below the face, to clamp the block by [default: none]
    rim_mm: Numbers
    rim: Text
    #: Registration mark: cut this length off the rim's corner at the picture's top left (+x, +y)
    mark_mm: Numbers
    mark: Text
    #: Where the coordinates of the files are counted from [default: exit]
    origin: Literal['exit', 'entry', 'stock-top', 'corner']
    #: Greatest distance of a STEP file's B-spline face from the height field, such as 0.05um [default: as near as the
    #: picture needs]
    step_tolerance_um: Numbers
    step_tolerance: Text
    #: Constant added to the light of the picture (0..1): it trades contrast for gentler slopes [default: 0.1]
    offset: float
    #: Part of the window that stays dark on every side of the picture, 0 to 0.45 [default: 0]
    margin: float
    #: Darken the picture towards its border: none, circle (dark outside of the ellipse within it), or circle:0.2
    #: (fading over this share of the radius) [default: none]
    vignette: Text
    #: How numbers in the picture become light, whatever its file says [default: as its profile or chunks say, else
    #: srgb; floats and OpenEXR linear]
    transfer: Literal['srgb', 'linear']
    #: Light behind the transparent parts of the picture: black, white or #rrggbb [default: black; white for SVG]
    background: Text
    #: The layer of an OpenEXR picture, or a single channel of it [default: the only one with colours]
    layer: Text
    #: Use a part of the picture: 100,50,640,480 or 10%,0%,80%,100% Of the upright picture, counted from its top left
    #: corner, in pixels or per cent.
    crop: Text
    #: Turn the picture clockwise: 90deg, 180deg or 270deg
    rotate: Text
    #: Mirror the picture: horizontal (left and right change places) or vertical
    flip: Text
    #: What becomes black and what white, 0 to 1 as image editors count, and the gamma in between: 0.1,0.9 or
    #: 0.05,0.8,1.2
    levels: Text
    #: Let dark and light change places
    invert: bool
    #: How the surface is found [default: transport]
    solver: Literal['transport', 'warping', 'warping-paper']
    #: How much work the transport solver puts in [default: normal]
    quality: Literal['draft', 'normal', 'fine']
    #: Bound the curvature of the face for a cutter of this radius, at some cost in accuracy (transport solver)
    min_radius_mm: Numbers
    min_radius: Text
    #: Make a face that is right after its polish: polish=0.1mm A polish that blurs heights with this standard
    #: deviation; also polish=0.1mm,cutter=ball:d6mm,step-over=0.1mm, and gain=6 limits how much any wave is amplified
    #: for it (transport solver).
    finish: Text
    #: Replace files that glasswarp did not write, or that were changed since
    force: bool


class VerifyOptions(TypedDict, total=False):
    """The keywords of verify: `glasswarp verify`."""

    #: Take the block exactly as it stands in its file, wherever and however that is. Otherwise it is brought where
    #: its bench has it, with a warning
    as_placed: bool
    #: The picture that its light shall draw [default: the one named in the side file]
    target: Path
    #: The side file with the bench [default: beside the block, with the extension .toml]
    bench: Path
    #: From z = 0 (of a block the mean plane of the exit face) to the receiver, on which the window stays where the
    #: light of a flat block falls [default: the side file's]
    distance_mm: Numbers
    distance: Text
    #: Refractive index [default: the side file's]
    ior: float
    #: Window on the receiver, around the axis: its width, or WIDTHxHEIGHT [default: the side file's, or the size of
    #: the solid]
    window_mm: Numbers
    window: Text
    #: Constant added to the light of the picture [default: the side file's]
    offset: float
    #: How numbers in the picture become light [default: the side file's]
    transfer: Literal['srgb', 'linear']
    #: How the surface between the vertices is understood [default: spline for a block, facets for another solid]
    surface: Literal['spline', 'smooth', 'facets']
    #: Count the light that is partially reflected at both faces (Fresnel, unpolarised)
    fresnel: bool
    #: Pixels across at which to judge, at most the picture's own [default: 1024]
    pixels: int
    #: Photons that confirm the beams and account for all light [default: 4000000]
    photons: int
    #: Seed of the photons [default: 1]
    seed: int
    #: Independent samples into which the photons are cut, at least 4: their spread is the noise, and a run has at
    #: most as many parts [default: 128]
    replicates: int
    #: Write the irradiance on the receiver: .exr (32-bit, linear) or .png (16-bit, linear). Of a sweep: .csv, .exr
    #: (all images as layers) or .png (the curves)
    output: Union[Path, Sequence[Path]]
    #: Look at the block in white light too, of which its material bends every colour otherwise, and write that
    #: picture: .png (sRGB) or .exr (linear, the primaries of sRGB)
    white: Path
    #: Write a report on the block, a page of HTML
    report: Path
    #: Fail (exit code 3) if the relative RMS error of the caustic exceeds this
    max_error: float
    #: Take more memory than this machine has free, if it must be
    ignore_memory: bool
    #: Replace files that glasswarp did not write, or that were changed since
    force: bool


class PhotonsOptions(VerifyOptions, total=False):
    """The keywords of photons."""

    #: Trace only part K of N of the run; 'glasswarp verify merge' adds the tallies up
    shard: Text


class ProgramOptions(VerifyOptions, total=False):
    """The keywords of program."""

    #: A tool: ball:d6mm (its diameter) or ball:r3mm, flat:d12mm, bull:d12mm,r1mm, vee:60deg,d6mm,
    #: taper:r1mm,5deg,d6mm; one of several with its number, as in 2=flat:d6mm. May be given several times [default:
    #: as comments of the program say]
    tool: Union[Text, Sequence[Text]]
    #: The block's own file, which the cut face is compared with [default: the one that the side file names]
    design: Path
    #: The program's zero: exit, entry, stock-top or corner, or X,Y,Z in the frame of the bench [default: the side
    #: file's]
    origin: Text
    #: The stock: its thickness, or WIDTHxHEIGHTxTHICKNESS [default: the side file's]
    stock_mm: Numbers
    stock: Text
    #: How far the machine's axes go, as in 300x200x80mm: what is larger is told
    travel_mm: Numbers
    travel: Text
    #: The machine's acceleration, per square second; without it time is that of feeds alone
    acceleration_mm: Numbers
    acceleration: Text
    #: The machine's speed of rapids [default: 5000mm/min]
    rapid_mm_per_min: Numbers
    rapid: Text
    #: Units of a program that names none
    units: Literal['mm', 'in']
    #: Polish the cut face: the standard deviation of the Gaussian that blurs its heights
    polish_mm: Numbers
    polish: Text
    #: Write NAME.cut.png beside the program: the light after every step, and a map of what the cut face lies off the
    #: design
    pictures: bool


class MergeOptions(TypedDict, total=False):
    """The keywords of merge: `glasswarp verify merge`."""

    #: Judge the light against this picture
    target: Path
    #: Constant added to the light of the picture [default: 0]
    offset: float
    #: How numbers in the picture become light [default: by its file]
    transfer: Literal['srgb', 'linear']
    #: Fail (exit code 3) if the relative RMS error, less its noise, exceeds this
    max_error: float
    #: Write the sum as a tally: byte by byte the file that one run of all parts writes
    tally: Path
    #: Write the irradiance on the receiver: .exr (32-bit, linear) or .png (16-bit, linear)
    output: Union[Path, Sequence[Path]]
    #: Replace files that glasswarp did not write, or that were changed since
    force: bool


class CheckOptions(TypedDict, total=False):
    """The keywords of check: `glasswarp check`."""

    #: The side file with the bench [default: beside the block, with the extension .toml]
    bench: Path
    #: Take the block exactly as it stands in its file, wherever and however that is. Otherwise it is brought where
    #: its bench has it, with a warning
    as_placed: bool
    #: Refractive index [default: the side file's]
    ior: float
    #: From the mean exit plane to the receiver [default: the side file's]
    distance_mm: Numbers
    distance: Text
    #: The finishing cutter: ball:d6mm (its diameter) or ball:r3mm (its radius, as is a size without a letter),
    #: flat:d12mm, bull:d12mm,r1mm (its corner's radius last) [default: ball:d6mm]
    cutter: Text
    #: From row to row [default: 0.1mm]
    step_over_mm: Numbers
    step_over: Text
    #: The polish after it: the standard deviation of the Gaussian that blurs heights [default: 0mm]
    polish_mm: Numbers
    polish: Text
    #: Steepest slope that the shop cuts [default: 45deg]
    max_slope_deg: Numbers
    max_slope: Text
    #: Furthest that scallops or facets may throw light from its place on the receiver [default: 0.5 % of the block's
    #: width]
    max_blur_mm: Numbers
    max_blur: Text
    #: Thickness of the sheet at hand [default: the thinnest standard sheet with facing_mm to spare]
    stock_mm: Numbers
    stock: Text
    #: What is faced off the top of a standard sheet before the face is cut [default: 0.5mm]
    facing_mm: Numbers
    facing: Text
    #: Least thickness that the block may have [default: 3mm]
    min_thickness_mm: Numbers
    min_thickness: Text
    #: Pixels across at which tolerances are judged, at most the picture's own [default: 512]
    pixels: int
    #: Write pictures of where: hollows, slopes, thickness, and those of the tolerances (.png)
    output: Path
    #: Trace what index, distance, tilt, form, thickness and the size of the light do to the picture, and find the
    #: depth of focus. Needs a side file
    tolerance: bool
    #: The index is off by this, to either side [default: 0.01]
    index_off: float
    #: The distance is off by this, to either side [default: 5mm]
    distance_off_mm: Numbers
    distance_off: Text
    #: The block is turned by this about x and about y [default: 1deg]
    tilt_off_deg: Numbers
    tilt_off: Text
    #: Form error of low order (power, astigmatism), peak to valley over the block [default: 50um]
    form_error_mm: Numbers
    form_error: Text
    #: The stock is thicker by this, and the receiver stands at its distance from the entry face [default: 0.5mm]
    thickness_off_mm: Numbers
    thickness_off: Text
    #: The block before this one stands aside by this along x and y, and nearer and further [default: 0.2mm]
    place_off_mm: Numbers
    place_off: Text
    #: Angular diameter of the light as seen from the block: sun (0.53deg), or 1.15deg for a torch of 20 mm a metre
    #: away. May be given several times [default: sun and 1.15deg]
    source_size: Union[Text, Sequence[Text]]
    #: The relative RMS error up to which a picture counts as in focus [default: twice that of the block]
    focus_error: float
    #: Replace files that glasswarp did not write, or that were changed since
    force: bool


class MillOptions(TypedDict, total=False):
    """The keywords of mill: `glasswarp mill`."""

    #: The side file with the bench [default: beside the block, with the extension .toml]
    bench: Path
    #: Take the block exactly as it stands in its file, wherever and however that is. Otherwise it is brought where
    #: its bench has it, with a warning
    as_placed: bool
    #: The finishing cutter: ball:d6mm (its diameter) or ball:r3mm (its radius, as is a size without a letter),
    #: flat:d12mm, bull:d12mm,r1mm (its corner's radius last) [default: ball:d6mm]
    cutter: Text
    #: From row to row [default: 0.1mm]
    step_over_mm: Numbers
    step_over: Text
    #: Direction of the rows: x, y or an angle such as 45deg [default: x]
    direction: Text
    #: What the pass leaves on the face, along its normal: 0 for finishing, the allowance for finishing of a roughing
    #: pass [default: 0mm]
    allowance_mm: Numbers
    allowance: Text
    #: Polish the milled face: the standard deviation of the Gaussian that blurs its heights
    polish_mm: Numbers
    polish: Text
    #: Feed of the cutter: gives the time [default: 2000mm/min]
    feed_mm_per_min: Numbers
    feed: Text
    #: Find the cheapest cutter and step-over of a list (TOML) that keep to want_error
    cutters: Path
    #: The relative RMS error of the picture that is wanted, after milling and polishing
    want_error: float
    #: Pixels across at which to judge, at most the picture's own [default: 1024]
    pixels: int
    #: Write the block as it is in the end (.stl, .obj, .glb), the pictures of all steps (.png), or the program of the
    #: pass (.ngc, .nc, .tap, .gcode, .cnc). May be given several times
    output: Union[Path, Sequence[Path]]
    #: How the way lies on the face: rows, spiral (from the middle outwards) or contour-parallel [default: rows]
    pattern: Text
    #: Cut all rows in the sense in which the cutter climbs, instead of to and fro
    climb: bool
    #: Rough in levels before, with this cutter
    rough: Text
    #: From level to level of roughing [default: a quarter of its cutter's diameter]
    step_down_mm: Numbers
    step_down: Text
    #: What roughing leaves, along the normal [default: 0.3mm]
    rough_allowance_mm: Numbers
    rough_allowance: Text
    #: The control: linuxcnc, grbl, mach, fanuc or haas [default: linuxcnc]
    post: Text
    #: Speed of the spindle, per minute [default: 18000]
    spindle: float
    #: How far above the stock the tip goes between cuts [default: 5mm]
    safe_height_mm: Numbers
    safe_height: Text
    #: How far strokes may lie off the face, in um [default: 0.001]
    chord_error_um: Numbers
    chord_error: Text
    #: Write rows along x or y as arcs: a third of the words, for controls that look ahead little
    arcs: bool
    #: Write a report on the work, a page of HTML
    report: Path
    #: Fail (exit code 3) if the relative RMS error of the picture exceeds this in the end
    max_error: float
    #: Replace files that glasswarp did not write, or that were changed since
    force: bool


class ReadyOptions(TypedDict, total=False):
    """The keywords of ready: `glasswarp ready`."""

    #: The side file with the bench [default: beside the block, with the extension .toml]
    bench: Path
    #: The finishing cutter: ball:d6mm (its diameter) or ball:r3mm (its radius, as is a size without a letter),
    #: flat:d12mm, bull:d12mm,r1mm (its corner's radius last) [default: ball:d6mm]
    cutter: Text
    #: From row to row [default: 0.1mm]
    step_over_mm: Numbers
    step_over: Text
    #: Direction of the rows: x, y or an angle such as 45deg [default: x]
    direction: Text
    #: The polish after it: the standard deviation of the Gaussian that blurs heights ('glasswarp coupon' makes a
    #: piece that tells it) [default: 0mm]
    polish_mm: Numbers
    polish: Text
    #: Size of the light in which it will be seen: sun, 0.5deg, 5mm, or none for a laser [default: that of the design]
    source_size: Text
    #: Feed of the cutter: gives the time [default: 2000mm/min]
    feed_mm_per_min: Numbers
    feed: Text
    #: Steepest slope that the shop cuts [default: 45deg]
    max_slope_deg: Numbers
    max_slope: Text
    #: Least thickness that the block may have [default: 3mm]
    min_thickness_mm: Numbers
    min_thickness: Text
    #: Pixels across at which to judge, at most the picture's own [default: 512]
    pixels: int
    #: The sheet to print (.html) [default: beside the block, .ready.html]
    output: Path
    #: Replace files that glasswarp did not write, or that were changed since
    force: bool


class CouponOptions(TypedDict, total=False):
    """The keywords of coupon: `glasswarp coupon`."""

    #: Where to: the block (.stl, .obj, .glb, .step, .3mf, .ply), the program of its finishing pass (.ngc), the page
    #: to read it by (.html). May be given several times [default: coupon.stl, coupon.step and coupon.html]. Without a
    #: page, one is written beside the first file
    output: Union[Path, Sequence[Path]]
    #: The finishing cutter, round: ball:d6mm (its diameter) or bull:d12mm,r1mm [default: ball:d6mm]
    cutter: Text
    #: The glass by name (`glasswarp materials`) [default: pmma]
    material: Text
    #: The refractive index that the glass is believed to have: where the light lies on the sheet
    ior: float
    #: From the flat face of the coupon to the sheet of paper on which it is read [default: 1m]
    distance_mm: Numbers
    distance: Text
    #: From the lamp to the flat face of the coupon [default: 3m]
    lamp_distance_mm: Numbers
    lamp_distance: Text
    #: Diameter of the part of the lamp that shines [default: 3mm]
    lamp_diameter_mm: Numbers
    lamp_diameter: Text
    #: Thickness of the sheet of glass [default: the thinnest standard sheet that leaves 3 mm]
    thickness_mm: Numbers
    thickness: Text
    #: Where the coordinates of all files are counted from [default: exit]
    origin: Literal['exit', 'entry', 'stock-top', 'corner']
    #: The program's step from row to row [default: 0.1mm]
    step_over_mm: Numbers
    step_over: Text
    #: The program's direction of rows: x, y or an angle such as 45deg. The ladder is read after rows along x only
    #: [default: x]
    direction: Text
    #: What the program leaves on the face, along its normal: 0 for finishing [default: 0mm]
    allowance_mm: Numbers
    allowance: Text
    #: The program's feed [default: 1000mm/min]
    feed_mm_per_min: Numbers
    feed: Text
    #: The program's speed of the spindle, per minute [default: 18000]
    spindle: float
    #: How far above the stock the program goes between cuts [default: 5mm]
    safe_height_mm: Numbers
    safe_height: Text
    #: Replace files that glasswarp did not write, or that were changed since
    force: bool


class CrosscheckOptions(TypedDict, total=False):
    """The keywords of crosscheck: `glasswarp crosscheck`."""

    #: Take the block exactly as it stands in its file, wherever and however that is. Otherwise it is brought where
    #: its bench has it, with a warning
    as_placed: bool
    #: The renderer
    with_: Literal['povray', 'blender', 'mitsuba', 'luxcore']
    #: What to compare [default: map]
    mode: Literal['map', 'image']
    #: Folder for the scene, which is kept [default: beside the block, its name with .crosscheck-RENDERER]
    scene: Path
    #: Only write the scene
    write_only: bool
    #: The renderer's executable, if it is not the usual one in the PATH
    program: Path
    #: The side file with the bench [default: beside the block, with the extension .toml]
    bench: Path
    #: Another distance from the mean plane of the exit face than the side file's
    distance_mm: Numbers
    distance: Text
    #: Another refractive index than the side file's
    ior: float
    #: Pixels across, rounded up to a multiple of 8 [default: 512]
    pixels: int
    #: Fail (exit code 3) if the difference exceeds this: in map mode the rms distance in mm, or one ray in a thousand
    #: landing by one of both only; in image mode the relative RMS at a quarter of the pixels, with the noise of one
    #: run
    max_difference: float
    #: Replace files that glasswarp did not write, or that were changed since
    force: bool


class MaterialsOptions(TypedDict, total=False):
    """The keywords of materials: `glasswarp materials`."""

    #: Replace files that glasswarp did not write, or that were changed since
    force: bool


class PresetsOptions(TypedDict, total=False):
    """The keywords of presets: `glasswarp presets`."""

    #: Replace files that glasswarp did not write, or that were changed since
    force: bool
