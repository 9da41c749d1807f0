"""``vpm`` and ``python -m vpm``: loads the commands, which takes a moment, and runs one."""

import os
import signal
import sys
from types import FrameType

from vpm.errors import INTERRUPTED


def main() -> None:
    """Run the command line; Ctrl-C ends it with one sentence, from its first moment to its last."""
    # A shell starts background work of a script deaf to Ctrl-C, which is meant for what runs in front.
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, _leave)
    from vpm.cli import main as command_line

    command_line()


def _leave(_number: int, _frame: FrameType | None) -> None:
    """End at once: libraries that are half loaded make something else of an exception, and there is nothing to lose."""
    sys.stderr.write("stopped by Ctrl-C\n")
    sys.stderr.flush()
    os._exit(INTERRUPTED)


if __name__ == "__main__":
    main()
