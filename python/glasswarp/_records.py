"""What calls return, as typed records. None stands for what is not known or not finite. Made by generate.py."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

from ._record import Record


@dataclass(frozen=True)
class Bench(Record):
    """Where the block stands."""

    #: From the mean plane of the exit face, along the axis.
    distance_mm: float
    #: Refractive index; null for a mirror.
    ior: Optional[float]
    #: The light in words.
    light: str
    #: Its middle, in the coordinates of the receiver.
    window_centre_mm: tuple[float, ...]
    #: Width and height of the picture on the receiver.
    window_mm: tuple[float, ...]


@dataclass(frozen=True)
class Block(Record):
    """A block of glass, or a mirror."""

    #: Height of the exit face.
    height_mm: float
    #: Height nodes along x and y.
    nodes: tuple[int, ...]
    #: Of the exit face, peak to valley.
    relief_mm: float
    #: From the entry face to the highest point.
    thickness_mm: float
    #: The thinnest place.
    thinnest_mm: float
    #: Width of the exit face.
    width_mm: float


@dataclass(frozen=True)
class BudgetStep(Record):
    """One step of the error budget."""

    #: Relative RMS difference from the light of the true surface of the file: what this step alone does.
    moved: Optional[float]
    #: What it is.
    name: str
    #: Relative root mean square error; null if the name says that it equals another step.
    rel_rms: Optional[float]
    #: Structural similarity.
    ssim: Optional[float]


@dataclass(frozen=True)
class Check(Record):
    """Whether a block can be made."""

    #: The file.
    file: str
    #: The lines of the verdict.
    lines: tuple[CheckLine, ...]
    #: Whether every line has passed.
    makeable: bool
    #: What tolerances do to the picture, with --tolerance.
    tolerances: Optional[Tolerances]
    #: Whether it will work, as far as it was asked.
    verdict: Verdict


@dataclass(frozen=True)
class CheckLine(Record):
    """A line of a verdict."""

    #: Whether it passed.
    passed: bool
    #: What was found, in words and with units.
    says: str
    #: What was checked.
    what: str


@dataclass(frozen=True)
class Concern(Record):
    """One thing that decides whether a block will work."""

    #: yes; yes, but; not yet asked; or no.
    answer: str
    #: What was asked: picture, light, cutter, ...
    question: str
    #: Why, and what to do.
    says: str


@dataclass(frozen=True)
class Coupon(Record):
    """A test coupon."""

    #: The block.
    block: Block
    #: The finishing cutter.
    cutter: str
    #: From its flat face to the sheet on which it is read.
    distance_mm: float
    #: Files written.
    files: tuple[str, ...]
    #: Refractive index that it is planned for.
    ior: float
    #: By how much the index is read too high for a millimetre that the sheet is too far away.
    ior_per_mm: float
    #: Diameter of the lamp.
    lamp_diameter_mm: float
    #: From the lamp to its flat face.
    lamp_distance_mm: float
    #: What is read from the traced light of the coupon after some work on it.
    readings: tuple[CouponReading, ...]
    #: The ladder, from its coarsest ruling.
    rulings: tuple[CouponRuling, ...]
    #: Radius of the sharpest hollow.
    sharpest_mm: float
    #: How far apart the two uprights stand on the sheet, by the index.
    uprights: tuple[CouponUprights, ...]


@dataclass(frozen=True)
class CouponReading(Record):
    """A test coupon, read by the rules of its page."""

    #: Its refractive index.
    ior: float
    #: The index that is read; null where the sheet cannot be read.
    ior_read: Optional[float]
    #: The polish that is read, standard deviation; null where the ladder cannot be read, and below it while rows
    #: show.
    polish_read_mm: Optional[float]
    #: The direction of the rows that is read, degrees from x towards y; null without a streak.
    rows_read_deg: Optional[float]
    #: What was done to it, in words.
    state: str
    #: The step-over that is read; null without a streak.
    step_over_read_mm: Optional[float]


@dataclass(frozen=True)
class CouponRuling(Record):
    """A ruling of a test coupon."""

    #: Amplitude of its wave.
    amplitude_mm: float
    #: Its number, from 1.
    number: int
    #: Period of its wave.
    period_mm: float
    #: Standard deviation of the polish that makes its bar as long as the marks.
    sigma_mm: float


@dataclass(frozen=True)
class CouponUprights(Record):
    """Where the uprights of a test coupon stand."""

    #: How far apart they stand.
    apart_mm: float
    #: Refractive index.
    ior: float


@dataclass(frozen=True)
class Crosscheck(Record):
    """What an independent renderer sees."""

    #: Differences between caustics by number of pixels, in image mode.
    image: tuple[ImageLevel, ...]
    #: Distances between landing points, in map mode.
    map: Optional[MapAgreement]
    #: The renderer.
    renderer: str
    #: Folder of the scene.
    scene: str


@dataclass(frozen=True)
class Design(Record):
    """A design."""

    #: The bench.
    bench: Bench
    #: The block.
    block: Block
    #: What each step from the solver to the files does to the light.
    budget: tuple[BudgetStep, ...]
    #: The most memory that the run was expected to take, bytes.
    expected_memory: int
    #: The files of the block and its height maps.
    files: tuple[str, ...]
    #: The light after the finish that the face is designed for.
    finished: Optional[Finished]
    #: The light that there is, from a source with a size or through a rough face; null where light is perfect.
    imperfect: Optional[Imperfect]
    #: The light through the file as read back; null with --no-verify.
    judgement: Optional[Judgement]
    #: What there is to say of single files.
    notes: tuple[str, ...]
    #: The pictures and pages drawn beside them.
    pictures: tuple[str, ...]
    #: Programs written, each read back and run over the block.
    programs: tuple[Program, ...]
    #: How the face was found.
    solver: Solver
    #: Whether it will work, as far as it was asked.
    verdict: Verdict


@dataclass(frozen=True)
class Deviation(Record):
    """Heights of a cut face less those of the design, micrometres."""

    #: Where it is, from the middle of the face.
    greatest_at_mm: tuple[float, ...]
    #: The greatest one.
    greatest_um: float
    #: The mean; above 0 where glass is left.
    mean_um: float
    #: Between these two lie 99 of 100 places.
    range_um: tuple[float, ...]
    #: Root of the mean square.
    rms_um: float
    #: Share of the face that is still as high as the stock.
    untouched: float


@dataclass(frozen=True)
class Distances(Record):
    """Distances between landing points."""

    #: Root mean square.
    rms_mm: Optional[float]
    #: Greatest.
    worst_mm: Optional[float]


@dataclass(frozen=True)
class Finished(Record):
    """The light after a finish."""

    #: rel_rms after a polish a tenth weaker and a tenth stronger than planned.
    if_off: Optional[tuple[Optional[float], ...]]
    #: Relative root mean square error.
    rel_rms: Optional[float]
    #: Structural similarity.
    ssim: Optional[float]


@dataclass(frozen=True)
class Focus(Record):
    """Distances between which a picture is in focus."""

    #: The furthest; null if it is further than was looked.
    far_mm: Optional[float]
    #: The relative RMS error up to which it counts.
    limit: float
    #: The nearest; null if it is nearer than was looked.
    near_mm: Optional[float]


@dataclass(frozen=True)
class ImageLevel(Record):
    """How caustics agree at one number of pixels."""

    #: The noise of one run.
    noise: Optional[float]
    #: Pixels across.
    pixels: int
    #: Relative RMS difference of one run.
    rel_rms: Optional[float]
    #: The difference without it.
    without_noise: Optional[float]


@dataclass(frozen=True)
class Imperfect(Record):
    """The light that there is."""

    #: Photons traced.
    photons: int
    #: Relative RMS difference between the images by photons and by the beams' light spread on the receiver, less the
    #: noise.
    photons_differ: Optional[float]
    #: Relative root mean square error, without the noise of photons where that is known.
    rel_rms: Optional[float]
    #: Its standard error; null without photons.
    rel_rms_error: Optional[float]
    #: Structural similarity, of the beams' light spread on the receiver.
    ssim: Optional[float]


@dataclass(frozen=True)
class Judgement(Record):
    """The light of a file."""

    #: Where the light went.
    light: Light
    #: Photons traced to confirm the beams.
    photons: int
    #: Relative RMS difference between the images by photons and by beams, less the noise.
    photons_differ: Optional[float]
    #: Standard error of that difference.
    photons_differ_error: Optional[float]
    #: Standard errors between photons and beams; beyond 4 the exit code is 3.
    photons_off: Optional[float]
    #: How well it draws the picture, where there is one.
    picture: Optional[Picture]
    #: Pixels along x and y.
    pixels: tuple[int, ...]


@dataclass(frozen=True)
class Light(Record):
    """Where light went, as parts of all that was sent out."""

    #: Past the solid.
    beside: float
    #: Lost by the tracer, which never should be.
    lost: float
    #: Onto the receiver beside the window.
    missed: float
    #: Partially reflected.
    reflected: float
    #: To a side wall, or into the solid again.
    side: float
    #: Totally reflected inside.
    totally_reflected: float
    #: Into the window.
    window: float


@dataclass(frozen=True)
class MapAgreement(Record):
    """How landing points agree."""

    #: Rays that land by one of both only.
    contested: int
    #: Rays that land by both.
    rays: int
    #: Distances with the same interpolated normals.
    smooth: Distances
    #: Distances with the verifier's spline surface.
    spline: Distances


@dataclass(frozen=True)
class Material(Record):
    """A material."""

    #: What it is.
    description: str
    #: Refractive index.
    ior: float
    #: What --material takes.
    name: str
    #: Where the index is from.
    source: str


@dataclass(frozen=True)
class Materials(Record):
    """The materials known by name."""

    #: All of them.
    materials: tuple[Material, ...]


@dataclass(frozen=True)
class Mill(Record):
    """A block milled in simulation."""

    #: The cutter.
    cutter: str
    #: The block.
    file: str
    #: Files written.
    files: tuple[str, ...]
    #: Way of the cutter.
    length_mm: float
    #: Time at the feed that was given, without acceleration.
    minutes: float
    #: Programs written, each read back and run over the block.
    programs: tuple[Program, ...]
    #: Rows of the pass.
    rows: int
    #: From row to row.
    step_over_mm: float
    #: The picture after every step.
    steps: tuple[MillStep, ...]
    #: Whether it will work, as far as it was asked.
    verdict: Verdict


@dataclass(frozen=True)
class MillStep(Record):
    """The picture after a step of the work."""

    #: What was done.
    name: str
    #: Height nodes along x and y.
    nodes: tuple[int, ...]
    #: Relative root mean square error.
    rel_rms: Optional[float]
    #: Structural similarity.
    ssim: Optional[float]


@dataclass(frozen=True)
class Picture(Record):
    """How well light draws a picture."""

    #: Darkest light as a part of the mean.
    black_level: Optional[float]
    #: Ratio of brightest and darkest light.
    contrast: Optional[float]
    #: Width of edges from 10 % to 90 %; null without edges.
    edge_width_mm: Optional[float]
    #: The photons' own opinion of rel_rms, less their noise.
    photons_rel_rms: Optional[float]
    #: The same in the picture.
    picture_black_level: Optional[float]
    #: The same in the picture.
    picture_contrast: Optional[float]
    #: The same in the picture.
    picture_edge_width_mm: Optional[float]
    #: Peak signal to noise ratio, dB.
    psnr_db: Optional[float]
    #: Relative root mean square error.
    rel_rms: Optional[float]
    #: Structural similarity, 1 for the same picture.
    ssim: Optional[float]


@dataclass(frozen=True)
class Preset(Record):
    """A preset."""

    #: What it is for.
    about: str
    #: The preset as a design file.
    design: str
    #: What --preset takes.
    name: str


@dataclass(frozen=True)
class Presets(Record):
    """The presets."""

    #: All of them.
    presets: tuple[Preset, ...]


@dataclass(frozen=True)
class Preview(Record):
    """A preview."""

    #: The bench.
    bench: Bench
    #: The coarse block.
    block: Block
    #: Files written.
    files: tuple[str, ...]
    #: Relative root mean square error of the draft.
    rel_rms: Optional[float]
    #: Structural similarity of the draft.
    ssim: Optional[float]


@dataclass(frozen=True)
class Program(Record):
    """A program of a machine, run over its block."""

    #: How far the cut face lies off the design.
    deviation: Deviation
    #: What is likely wrong with the program, and what to do.
    diagnoses: tuple[str, ...]
    #: What would harm the machine, the cutter or the block.
    faults: tuple[str, ...]
    #: Their length.
    feed_mm: float
    #: Those of them that feed.
    feed_moves: int
    #: The file.
    file: str
    #: Files written.
    files: tuple[str, ...]
    #: Time with feeds and acceleration.
    minutes: float
    #: Moves in it.
    moves: int
    #: Length of the rapids, as far as their ends are known.
    rapid_mm: float
    #: The finest decimal of its coordinates; null where there are none.
    resolution_mm: Optional[float]
    #: The face as designed, as the program cuts it, and polished, each with its light; only the first where the block
    #: is cut through.
    steps: tuple[MillStep, ...]
    #: Its tools, as number=shape.
    tools: tuple[str, ...]


@dataclass(frozen=True)
class Ready(Record):
    """Whether a block is ready to be made."""

    #: The block.
    file: str
    #: Files written.
    files: tuple[str, ...]
    #: Of the finishing cutter, minutes.
    minutes: float
    #: Relative RMS error of what the eye gets: of the finished face, in the real light.
    rel_rms: Optional[float]
    #: The piece to saw from it, along x and y.
    sawn_mm: tuple[float, ...]
    #: The standard sheet to order; null if none is thick enough.
    sheet_mm: Optional[float]
    #: Structural similarity of the same.
    ssim: Optional[float]
    #: Whether it will work.
    verdict: Verdict


@dataclass(frozen=True)
class Solver(Record):
    """How a face was found."""

    #: Iterations on all levels.
    iterations: int
    #: Levels that stopped at their limit of iterations.
    levels_at_limit: int
    #: Name of the solver.
    name: str
    #: What the solver has to say.
    notes: tuple[str, ...]
    #: Wall-clock time, seconds.
    seconds: float


@dataclass(frozen=True)
class Stack(Record):
    """Plates in a row."""

    #: The file that names them.
    file: str
    #: The plates, in the order of the light.
    plates: tuple[Design, ...]


@dataclass(frozen=True)
class StackLight(Record):
    """What was found of plates in a row."""

    #: Every plate with those before it, in the order of the light.
    plates: tuple[Verify, ...]


@dataclass(frozen=True)
class Sweep(Record):
    """Errors along a range."""

    #: Files written.
    files: tuple[str, ...]
    #: What was found at every place.
    points: tuple[SweepPoint, ...]
    #: What was varied, with its unit.
    swept: str


@dataclass(frozen=True)
class SweepPoint(Record):
    """One place along a range."""

    #: rel_rms of the displaced surface.
    displaced: Optional[float]
    #: rel_rms of flat triangles.
    facets: Optional[float]
    #: rel_rms on the normal-mapped plane.
    plane: Optional[float]
    #: Relative RMS difference between plane and displaced surface.
    plane_moves: Optional[float]
    #: Relief of the face.
    relief_mm: float
    #: rel_rms of triangles with smooth normals.
    smooth: Optional[float]
    #: The varied quantity.
    value: float


@dataclass(frozen=True)
class Tally(Record):
    """A photon run, a part of one, or the sum of parts."""

    #: Whether these are all photons of the run.
    complete: bool
    #: Where the light went.
    light: Light
    #: Noise of a pixel, as a part of the mean irradiance.
    noise: Optional[float]
    #: Photons traced.
    photons: int
    #: Relative root mean square error less its noise, where there is a picture.
    rel_rms: Optional[float]
    #: Standard error of that.
    rel_rms_error: Optional[float]


@dataclass(frozen=True)
class Text(Record):
    """Text for another program: a man page, shell completions, a preset."""

    #: The text.
    text: str


@dataclass(frozen=True)
class Tolerance(Record):
    """What is off, and what the picture is then, looked at where it falls."""

    #: Relative RMS difference from the picture of the block as it was designed.
    moved: Optional[float]
    #: What it is.
    name: str
    #: Its width and height, as parts of those of the design.
    picture_growth: tuple[float, ...]
    #: How far the whole picture moves on the receiver.
    picture_moved_mm: tuple[float, ...]
    #: Relative root mean square error; null where no light falls into the window.
    rel_rms: Optional[float]
    #: Structural similarity.
    ssim: Optional[float]


@dataclass(frozen=True)
class Tolerances(Record):
    """What tolerances do to a picture."""

    #: What can be off.
    cases: tuple[Tolerance, ...]
    #: rel_rms as designed.
    designed: Optional[float]
    #: The depth of focus.
    focus: Focus
    #: What means nothing on this bench.
    left_out: tuple[str, ...]


@dataclass(frozen=True)
class Verdict(Record):
    """Whether a block will work, from everything that was asked."""

    #: yes; yes, but; not yet asked; or no.
    answer: str
    #: What it rests on.
    concerns: tuple[Concern, ...]
    #: The same with its reasons.
    says: str


@dataclass(frozen=True)
class Verify(Record):
    """The light through a block or solid, judged."""

    #: The bench.
    bench: Bench
    #: What other views of the same file do to the light.
    budget: tuple[BudgetStep, ...]
    #: The file.
    file: str
    #: Files written.
    files: tuple[str, ...]
    #: The light after the finish that the face is designed for.
    finished: Optional[Finished]
    #: The light that there is, from a source with a size or through a rough face; null where light is perfect.
    imperfect: Optional[Imperfect]
    #: The light.
    judgement: Judgement
    #: What it holds: block, or solid (traced as flat triangles).
    kind: str
    #: The constant added to the light of the picture.
    offset: Optional[float]
    #: Its size along x and y.
    size_mm: tuple[float, ...]
    #: The light of all colours, with --white.
    white: Optional[White]


@dataclass(frozen=True)
class White(Record):
    """White light."""

    #: Indices of blue (486.1 nm) and red (656.3 nm).
    ior: tuple[float, ...]
    #: Distance between their landing points, root mean square.
    parting_rms_mm: Optional[float]
    #: The greatest such distance.
    parting_worst_mm: Optional[float]
    #: Relative root mean square difference of the brightness from the light of one colour.
    rel_rms: Optional[float]


#: What commands return.
RESULTS: tuple[type[Record], ...] = (Design, Stack, Verify, StackLight, Preview, Tally, Sweep, Check, Mill, Program, Ready, Crosscheck, Coupon, Materials, Presets, Text)
