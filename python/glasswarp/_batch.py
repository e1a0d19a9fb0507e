"""Many calls on many cores or machines, by whatever runs them."""

from __future__ import annotations

import itertools
import os
import pathlib
import tempfile
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Callable, Generic, TypeVar, cast

from . import _records
from ._commands import AnyBlock, check, merge, photons
from ._errors import BadInput, GlasswarpError, GlasswarpWarning
from ._progress import Progress, Told

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._keywords import MergeOptions, PhotonsOptions

_Found = TypeVar("_Found")


@dataclass(frozen=True)
class Task(Generic[_Found]):
    """A call that is done later, somewhere: `Task(design, ("portrait.png",), {"nodes": 641})`.

    It is plain data, and its result is the same wherever and however often it is done. Arrays and blocks travel with it;
    files that it names must be there where it is done.
    """

    #: What is called: a function of glasswarp, or any other that can be pickled.
    call: Callable[..., _Found]
    #: Its arguments.
    args: tuple[Any, ...] = ()
    #: Its keywords.
    kwargs: Mapping[str, Any] = field(default_factory=dict)

    def __call__(self) -> _Found:
        return self.call(*self.args, **self.kwargs)


def _done(task: Task[_Found]) -> _Found:
    return task()


def _submitted(executor: Any, task: Task[Any]) -> Callable[[], Any]:
    """Hands a task to an executor; returns what waits for its result."""
    if hasattr(executor, "submit"):
        # Dask takes equal calls for one, unless it is told that they are not; no other executor knows the word.
        by_dask = type(executor).__module__.partition(".")[0] in ("distributed", "dask")
        future = executor.submit(_done, task, pure=False) if by_dask else executor.submit(_done, task)
        return cast("Callable[[], Any]", future.result)
    if hasattr(executor, "apply_async"):
        return cast("Callable[[], Any]", executor.apply_async(_done, (task,)).get)
    raise BadInput(
        f"{type(executor).__name__} runs no tasks: an executor has submit(), as those of concurrent.futures and Dask's"
        " Client, or apply_async(), as Ray's and the standard library's pools",
        setting="executor",
        value=executor,
    )


def batch(
    tasks: Iterable[Task[_Found]],
    executor: Any = None,
    *,
    retries: int = 3,
    progress: Progress = None,
) -> list[_Found]:
    """Does tasks on whatever runs them, and returns their results in order.

    Args:
        tasks: What is to be done.
        executor: One of `concurrent.futures`, Dask's `Client`, Ray's `ray.util.multiprocessing.Pool`, or anything else with
            `submit` or `apply_async`; None does them here, one after another, each on all cores.
        retries: How often a task is done again that was lost with its worker. Its result is the same. What a pool that has
            broken cannot do is done here in the end, with a warning.
        progress: Called with "batch", the tasks done, and how many there are.

    Raises:
        GlasswarpError: The first one that a task raised: it would raise it anywhere.
    """
    tasks = list(tasks)
    found: list[_Found] = []
    with Told(progress) as listener:

        def tell() -> None:
            if listener is not None:
                listener("batch", len(found), len(tasks))

        tell()
        waiting = [None if executor is None else _attempt(executor, task) for task in tasks]
        for task, result in zip(tasks, waiting):
            found.append(task() if result is None else _again(executor, task, result, retries))
            tell()
    return found


def _attempt(executor: Any, task: Task[Any]) -> Callable[[], Any]:
    """The same as `_submitted`, whose failure is told when the result is waited for."""
    try:
        return _submitted(executor, task)
    except BadInput:
        raise
    except Exception as error:
        lost = error

        def raises() -> Any:
            raise lost

        return raises


def _again(executor: Any, task: Task[_Found], result: Callable[[], Any], retries: int) -> _Found:
    for left in reversed(range(retries + 1)):
        try:
            return cast(_Found, result())
        except Exception as error:
            if isinstance(error, GlasswarpError) or _is_of_the_call(error):
                raise
            if left:
                result = _attempt(executor, task)
                continue
            warnings.warn(
                f"{type(executor).__name__} has lost a task {retries + 1} times ({error!r}); it is done here",
                GlasswarpWarning,
                stacklevel=3,
            )
    return task()


def _is_of_the_call(error: Exception) -> bool:
    """Whether a call would raise this anywhere, as opposed to losing its worker."""
    return isinstance(error, (ArithmeticError, AttributeError, ImportError, LookupError, TypeError, ValueError))


def grid(call: Callable[..., _Found], *args: Any, **kwargs: Any) -> list[Task[_Found]]:
    """Tasks for every combination of keywords whose values are lists; the last one changes fastest.

    >>> [task.kwargs for task in grid(check, "portrait.stl", step_over_mm=[0.1, 0.2], polish_mm=0.1)]
    [{'step_over_mm': 0.1, 'polish_mm': 0.1}, {'step_over_mm': 0.2, 'polish_mm': 0.1}]
    """
    values = [value if isinstance(value, list) else [value] for value in kwargs.values()]
    return [Task(call, args, dict(zip(kwargs, one))) for one in itertools.product(*values)]


def tolerance_grid(block: AnyBlock, **options: Any) -> list[Task[_records.Check]]:
    """Tasks that trace what tolerances do to a block: `tolerance_grid(block, tilt_off_deg=[0.5, 1, 2])`.

    Options are those of `check`; every one may be a list.
    """
    return grid(check, block, **{"tolerance": True, **options})


def _shard(block: AnyBlock, options: Mapping[str, Any]) -> bytes:
    with tempfile.TemporaryDirectory(prefix="glasswarp-") as folder:
        tally = os.path.join(folder, "part.exr")
        photons(block, tally, **cast(Any, options))
        return pathlib.Path(tally).read_bytes()


def photon_shards(block: AnyBlock, shards: int, **options: Unpack[PhotonsOptions]) -> list[Task[bytes]]:
    """The parts of one photon run as tasks; each gives the bytes of its tally, which `merge_shards` adds up.

    Args:
        block: A block, or its file.
        shards: How many parts.
        options: Those of `photons`. The run is the same for any number of parts.
    """
    if shards < 1:
        raise BadInput(f"a run has at least one part, not {shards}", setting="shards", value=shards)
    return [Task(_shard, (block, {**options, "shard": f"{k}/{shards}"})) for k in range(1, shards + 1)]


def merge_shards(parts: Sequence[bytes], **options: Unpack[MergeOptions]) -> _records.Tally:
    """Adds up the tallies of `photon_shards`; `tally="all.exr"` writes byte by byte what one run writes."""
    with tempfile.TemporaryDirectory(prefix="glasswarp-") as folder:
        files = [pathlib.Path(folder, f"part-{k}.exr") for k in range(len(parts))]
        for file, part in zip(files, parts):
            file.write_bytes(part)
        return merge(*files, **options)
