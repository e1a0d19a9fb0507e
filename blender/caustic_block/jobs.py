"""Solving in threads: Blender never waits, and only `pump`, in the main thread, touches its data."""

import threading
import time
import warnings

import bpy
import glasswarp as gw
from bpy.app.handlers import persistent

from . import bench, picture, scene, settings, solid

#: A draft begins so long after the last change, seconds.
PAUSE = 0.4
#: Between two looks at what is going on, seconds.
TICK = 0.1

#: By the block's uid: the newest job, and when a draft is due.
_jobs = {}
_due = {}
#: Jobs that were told to end and have not yet.
_ending = []
#: The last block that was solved for: uid -> (request, block of glasswarp).
_solved = {}
#: What the panel was last drawn with: to draw takes time from solving.
_seen = []
#: Jobs take turns: each uses all cores, and warnings of Python are caught for all threads at once.
_turn = threading.Lock()


class Cancelled(Exception):
    """Somebody has cancelled it."""


class Job(threading.Thread):
    """A block in the making."""

    def __init__(self, thing, draft):
        super().__init__(name="caustic block", daemon=True)
        wanted = settings.of(thing)
        self.uid = wanted.uid
        self.draft = draft
        self.request = settings.request(wanted, draft)
        self.keywords = settings.keywords(wanted, draft)
        self.picture = picture.taken(wanted.image)
        if not isinstance(self.picture, str) and self.picture.max() > 0:
            # White is 1 in Blender as in files; of an array glasswarp takes the greatest value for it.
            self.keywords["offset"] /= float(self.picture.max())
        self.stage, self.done, self.steps = "waiting", 0, 0
        self.block = self.solid = self.bench = self.error = None
        self.said = []
        self._cancelled = threading.Event()

    def cancel(self):
        self._cancelled.set()

    @property
    def cancelled(self):
        return self._cancelled.is_set()

    @property
    def progress(self):
        """From 0 to 1; 0 where nobody knows."""
        return min(self.done / self.steps, 1.0) if self.steps else 0.0

    def _tell(self, stage, done, steps):
        if self.cancelled:
            raise Cancelled
        self.stage, self.done, self.steps = stage, done, steps

    def run(self):
        try:
            with _turn:
                self.make()
        except Exception as error:
            self.error = error

    def make(self):
        """Solves, in the thread that calls it."""
        self._tell("starting", 0, 0)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            self.block = gw.design(self.picture, progress=self._tell, **self.keywords)
            self._tell("taking the mesh", 0, 0)
            self.solid, told = solid.exported(self.block)
        self.bench = bench.Bench.of(told, self.solid, self.keywords.get("source_size", ""), self.block.target.max())
        self.said = [str(one.message) for one in caught if issubclass(one.category, gw.GlasswarpWarning)]


def start(thing, draft):
    """Begins to solve for a block; what was going on for it ends.

    Raises:
        picture.NoPicture: There is no picture that glasswarp can take.
    """
    settings.own(thing)
    job = Job(thing, draft)
    cancel(thing)
    settings.of(thing).fault = ""
    _jobs[job.uid] = job
    job.start()
    wake()
    return job


def cancel(thing):
    """Ends what is going on for a block. What it shows stays."""
    uid = settings.of(thing).uid
    _due.pop(uid, None)
    job = _jobs.pop(uid, None)
    if job is not None:
        job.cancel()
        _ending.append(job)


def job_of(thing):
    """What is going on for a block, or `None`."""
    return _jobs.get(settings.of(thing).uid)


def touch(thing):
    """A setting was changed: a draft is due in a moment."""
    if settings.of(thing) is None:
        return
    settings.own(thing)
    _due[settings.of(thing).uid] = time.monotonic() + PAUSE
    wake()


def solved(thing):
    """The block of glasswarp that was solved for with the settings as they are; `None` if that was not done since Blender started."""
    wanted = settings.of(thing)
    asked, block = _solved.get(wanted.uid, (None, None))
    return block if block is not None and asked == settings.request(wanted, draft=False) else None


def take(thing, job):
    """Shows what a job has made."""
    wanted = settings.of(thing)
    scene.show(thing, job.solid, job.bench)
    size = job.block.size
    settings.set_shown(thing, job.request)
    wanted.shown_nodes, wanted.fault = size.nodes[0], ""
    lines = [
        f"{size.width_mm:.4g} x {size.height_mm:.4g} x {size.thickness_mm:.4g} mm, relief {size.relief_mm:.3g} mm",
        *job.said,
        *job.block.summary.warnings,
    ]
    wanted.about = "\n".join(dict.fromkeys(lines))
    if not job.draft:
        _solved[wanted.uid] = (job.request, job.block)


def pump():
    """Looks once at what is going on, and shows what is ready. Timers call it; in the background, where there are none, whoever waits."""
    things = {settings.of(thing).uid: thing for thing in settings.blocks()}
    for uid in [uid for uid in (*_due, *_jobs) if uid not in things]:
        # The object is gone.
        _due.pop(uid, None)
        if uid in _jobs:
            _jobs[uid].cancel()
            _ending.append(_jobs.pop(uid))
    for uid, due in list(_due.items()):
        # A solve that somebody has asked for goes on, and is out of date when it ends.
        busy = uid in _jobs and not _jobs[uid].draft
        if time.monotonic() >= due and not busy:
            del _due[uid]
            _draft(things[uid])
    for uid, job in list(_jobs.items()):
        # Blender's edit mode holds a mesh of its own.
        if not job.is_alive() and things[uid].mode != "EDIT":
            del _jobs[uid]
            _finish(things[uid], job)
    _ending[:] = [job for job in _ending if job.is_alive()]
    _redraw()
    return TICK if _jobs or _due or _ending else None


def _draft(thing):
    wanted = settings.of(thing)
    try:
        if settings.shown(thing) not in asked(wanted):
            start(thing, draft=True)
        elif job_of(thing) is not None:
            cancel(thing)
    except picture.NoPicture as error:
        wanted.fault = str(error)


def asked(wanted):
    """What the settings ask for: the block, and its draft."""
    return settings.request(wanted, draft=False), settings.request(wanted, draft=True)


def _finish(thing, job):
    wanted = settings.of(thing)
    if job.error is not None:
        wanted.fault = "" if isinstance(job.error, Cancelled) else said(job.error)
        return
    try:
        current = settings.request(wanted, job.draft)
    except picture.NoPicture as error:
        wanted.fault = str(error)
        return
    if current == job.request:
        take(thing, job)
    else:
        job.error = Cancelled()
        if wanted.live:
            touch(thing)


def said(error):
    """An error in words: glasswarp's own."""
    return str(error) if str(error) else type(error).__name__


def wait(job):
    """Pumps until a job has ended, where no timers run."""
    while job in _jobs.values():
        pump()
        time.sleep(0.02)


def going_on():
    """The jobs whose end has not been seen."""
    return list(_jobs.values())


def busy():
    """Whether anything is going on or due."""
    return bool(_jobs or _due)


def wake():
    if not bpy.app.background and not bpy.app.timers.is_registered(pump):
        bpy.app.timers.register(pump, first_interval=TICK, persistent=True)


def _redraw():
    global _seen
    seen = [(uid, id(job), job.stage, int(100 * job.progress)) for uid, job in _jobs.items()]
    if seen == _seen:
        return
    _seen = seen
    for window in getattr(bpy.context.window_manager, "windows", ()):
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def end_all(*, join):
    """Ends everything; `join` waits for it."""
    for job in _jobs.values():
        job.cancel()
        _ending.append(job)
    _jobs.clear()
    _due.clear()
    if join:
        for job in _ending:
            job.join(10)
        _ending.clear()


@persistent
def _before_load(*_):
    end_all(join=False)
    _solved.clear()


@persistent
def _after_undo(*_):
    # Settings go back by themselves; a mesh that came after the step, as drafts do, may stay.
    for thing in settings.blocks():
        wanted = settings.of(thing)
        try:
            fits = settings.shown(thing) in asked(wanted)
        except picture.NoPicture:
            continue
        if wanted.live and not fits:
            touch(thing)


_HANDLERS = (("load_pre", _before_load), ("undo_post", _after_undo), ("redo_post", _after_undo))


def register():
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister():
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
    if bpy.app.timers.is_registered(pump):
        bpy.app.timers.unregister(pump)
    end_all(join=True)
    _solved.clear()
