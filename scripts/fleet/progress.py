# SPDX-License-Identifier: BSD-3-Clause
"""How far a run is: one line on standard error where that is a terminal, else nothing."""
import sys
import time

_EACH = 0.2  # s


class Progress:
    def __init__(self, what, total=None):
        self._what, self._total = what, total
        self._shows = sys.stderr.isatty()
        self._start = time.monotonic()
        self._last = 0.0

    def __call__(self, done):
        now = time.monotonic()
        if not self._shows or now - self._last < _EACH:
            return
        self._last = now
        text = "%s: %d" % (self._what, done)
        if self._total:
            text += " of %d" % self._total
            if done:
                left = (now - self._start) * (self._total - done) / done
                text += ", %.3g/s, %s left" % (done / max(now - self._start, 1e-3), _duration(left))
        sys.stderr.write("\r\033[K" + text)
        sys.stderr.flush()

    def end(self):
        if self._shows:
            sys.stderr.write("\r\033[K")
            sys.stderr.flush()


def _duration(seconds):
    if seconds < 120:
        return "%.0f s" % seconds
    return "%.0f min" % (seconds / 60) if seconds < 7200 else "%.1f h" % (seconds / 3600)
