"""The command `glasswarp`, as the program has it."""

from __future__ import annotations

import signal
import sys

from . import _glasswarp


def main() -> None:
    """Runs the command with the words of this process, and exits as it does."""
    # The command has a way of its own to end: nothing half-written is left.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.stdout.flush()
    sys.exit(_glasswarp.main(sys.argv[1:]))


if __name__ == "__main__":
    main()
