"""How far it is, at what rate, and how long it will take: one line on standard error."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import Optional

_EACH_S = 0.5
_EACH_S_IN_A_FILE = 30.0
_WIDTH = 30


def _in_words(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02} min" if hours else f"{minutes} min {rest:02} s" if minutes else f"{rest} s"


class Bar:
    """Is called with the number of things by their state; on a terminal a line that changes, else a line now and then."""

    def __init__(self, total: int, quiet: bool, things: str = "logs") -> None:
        self.total, self.quiet, self.things = total, quiet, things
        self._terminal = sys.stderr.isatty()
        self._start: Optional[tuple[float, int]] = None  # the rate is that of this run, not of one before that it resumes
        self._last = 0.0

    def __enter__(self) -> Bar:
        return self

    def __exit__(self, kind: Optional[type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]) -> None:
        if self._terminal and not self.quiet:
            print(file=sys.stderr)

    def line(self, counts: dict[str, int], now: float) -> str:
        done = counts.get("done", 0) + counts.get("failed", 0)
        if self._start is None:
            self._start = (now, done)
        rate = (done - self._start[1]) / max(now - self._start[0], 1e-9)
        left = f"{_in_words((self.total - done) / rate)} left" if rate > 0 and done < self.total else ""
        bar = "#" * (_WIDTH * done // max(self.total, 1))
        failed = f", {counts['failed']} failed" if counts.get("failed") else ""
        return f"[{bar:<{_WIDTH}}] {done} of {self.total} {self.things}{failed}, {rate:.1f}/s {left}".rstrip()

    def __call__(self, counts: dict[str, int]) -> None:
        now = time.monotonic()
        finished = counts.get("done", 0) + counts.get("failed", 0) >= self.total
        if self.quiet or (not finished and now - self._last < (_EACH_S if self._terminal else _EACH_S_IN_A_FILE)):
            return
        self._last = now
        print(f"\r\033[K{self.line(counts, now)}" if self._terminal else self.line(counts, now), end="" if self._terminal else "\n",
              file=sys.stderr, flush=True)
