"""How far a call is, for people."""

from __future__ import annotations

import importlib
import sys
import warnings
from types import TracebackType
from typing import Any, Callable, Optional, Union

#: Called with the name of a stage, the steps done, and how many there are (0: nobody knows).
Listener = Callable[[str, int, int], object]
#: None shows bars in notebooks that have tqdm, True shows them anywhere, False never.
Progress = Union[Listener, bool, None]


def _in_notebook() -> bool:
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return type(shell).__name__ == "ZMQInteractiveShell"


class _Bars:
    """A bar of tqdm for every stage, gone when the call returns."""

    def __init__(self, tqdm: Any) -> None:
        self._tqdm = tqdm
        self._bar: Any = None
        self._stage: Optional[str] = None

    def __call__(self, stage: str, done: int, steps: int) -> None:
        if self._bar is None or stage != self._stage or done < self._bar.n:
            self.close()
            self._stage = stage
            self._bar = self._tqdm(total=steps or None, desc=stage, leave=False)
        self._bar.update(done - self._bar.n)

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()
            self._bar = None


class Told:
    """A listener for the time of one call."""

    def __init__(self, progress: Progress) -> None:
        self._bars: Optional[_Bars] = None
        self.listener: Optional[Listener] = None
        if callable(progress):
            self.listener = progress
        elif progress or (progress is None and _in_notebook()):
            try:
                with warnings.catch_warnings():
                    # Without ipywidgets a notebook gets bars of text.
                    warnings.simplefilter("ignore")
                    tqdm = importlib.import_module("tqdm.auto").tqdm
            except ImportError:
                if progress:
                    raise
                return
            self.listener = self._bars = _Bars(tqdm)

    def __enter__(self) -> Optional[Listener]:
        return self.listener

    def __exit__(
        self,
        kind: Optional[type[BaseException]],
        error: Optional[BaseException],
        trace: Optional[TracebackType],
    ) -> None:
        if self._bars is not None:
            self._bars.close()
