"""The limit of open files of this process; every client is one."""

from __future__ import annotations

try:
    import resource
except ImportError:  # Windows has no such limit for sockets
    resource = None

MOST_FILES = 65536
"""Open files to permit; the usual limit of 1024 is too low for many clients."""


def allow_many_files() -> int:
    """Raise the limit of open files as far as this process may, up to `MOST_FILES`; returns it."""
    if resource is None:
        return MOST_FILES
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = MOST_FILES if hard == resource.RLIM_INFINITY else min(hard, MOST_FILES)
    if soft == resource.RLIM_INFINITY or soft >= wanted:
        return MOST_FILES if soft == resource.RLIM_INFINITY else soft
    try:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
    except (OSError, ValueError):  # macOS permits fewer than its hard limit names
        return soft
    return wanted
