"""The command `steptwin` in processes that begin warm: forked from one that has imported what most of its work needs.

Those imports take a second of a processor, and hundreds of tests start the command. Sockets, signals, descriptors and the end
are those of any process. `cli/test_main.py` and `test_wheel.py` start it as users do.

`python warm.py FD` waits at this end of a pair of sockets for requests: JSON, with the descriptors 0, 1 and 2 of the process.
"""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import gc
import json
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path

COMMAND = str(Path(sys.executable).with_name("steptwin"))
IMPORTED = ("steptwin.cli", "steptwin.live.studio.start", "steptwin.studio.service", "steptwin.lsp.server", "steptwin.dap.attach")
MOST_BYTES = 1 << 17
PR_SET_CHILD_SUBREAPER = 36


class Warm:
    """The process that is forked, which starts when it is first needed."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._channel: socket.socket | None = None
        self._one_at_a_time = threading.Lock()
        """For tests that start processes in several threads: an answer is that to the request before it."""

    @staticmethod
    def can(command: object, environment: Mapping[str, str]) -> bool:
        """Not what Python reads at its own start."""
        read = {name for name in {*environment, *os.environ} if name.startswith(("PYTHON", "LC_", "LANG"))}
        is_same = all(environment.get(name) == os.environ.get(name) for name in read)
        return sys.platform == "linux" and isinstance(command, list) and command[:1] == [COMMAND] and is_same

    def fork(self, arguments: Sequence[str], directory: str, environment: Mapping[str, str], descriptors: Sequence[int]) -> int:
        """The number of a child of this process."""
        with self._one_at_a_time:
            return self._fork(arguments, directory, environment, descriptors)

    def _fork(self, arguments: Sequence[str], directory: str, environment: Mapping[str, str], descriptors: Sequence[int]) -> int:
        if self._channel is None:
            # What a child leaves behind becomes a child of this process.
            assert ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) == 0
            self._channel, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            with other:
                command = [sys.executable, __file__, str(other.fileno())]
                self._process = subprocess.Popen(command, pass_fds=[other.fileno()], start_new_session=True)
        request = json.dumps([arguments, directory, dict(environment)]).encode("utf-8", "surrogateescape")
        assert len(request) <= MOST_BYTES
        socket.send_fds(self._channel, [request], list(descriptors))
        return int(self._channel.recv(100))

    def close(self) -> None:
        if self._channel is not None and self._process is not None:
            self._channel.close()
            self._process.wait()


def _child_of_whoever_asks(channel: socket.socket) -> bool:
    """Fork twice, so that the first fork's end leaves the second one to the process that asks; true there."""
    reading, writing = os.pipe()
    first = os.fork()
    if first == 0:
        second = os.fork()
        if second == 0:
            channel.close()
            os.close(reading)
            os.close(writing)
            return True
        os.write(writing, str(second).encode())
        os._exit(0)
    os.close(writing)
    number = os.read(reading, 100)
    os.close(reading)
    os.waitpid(first, 0)
    channel.send(number)
    return False


def _wait(channel: socket.socket) -> bool:
    """Serve requests until nobody is there any more; true in each process that was asked for."""
    while True:
        request, descriptors, _, _ = socket.recv_fds(channel, MOST_BYTES, 3)
        if not request:
            return False
        if _child_of_whoever_asks(channel):
            break
        for descriptor in descriptors:
            os.close(descriptor)
    arguments, directory, environment = json.loads(request.decode("utf-8", "surrogateescape"))
    for number, descriptor in enumerate(descriptors):
        os.dup2(descriptor, number)
        os.close(descriptor)
    os.environ.clear()
    os.environ.update(environment)
    with contextlib.suppress(FileNotFoundError):
        os.chdir(directory)
    sys.argv = [COMMAND, *arguments]
    sys.path[0] = str(Path(COMMAND).parent)
    sys.stdin = sys.__stdin__ = open(0, closefd=False)  # noqa: SIM115
    sys.stdout = sys.__stdout__ = open(1, "w", closefd=False)  # noqa: SIM115
    sys.stderr = sys.__stderr__ = open(2, "w", buffering=1, errors="backslashreplace", closefd=False)  # noqa: SIM115
    return True


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for name in IMPORTED:
        import_module(name)
    gc.collect()
    gc.freeze()
    with socket.socket(fileno=int(sys.argv[1])) as requests:
        if not _wait(requests):
            sys.exit()
    from steptwin.cli import main

    try:
        code: object = main()
    except SystemExit as ended:
        code = ended.code
    if isinstance(code, str) or any(not one.daemon for one in {*threading.enumerate()} - {threading.main_thread()}):
        sys.exit(code)  # type: ignore[arg-type]
    # To take all modules down again would take half a second.
    atexit._run_exitfuncs()
    sys.stdout.flush()
    os._exit(code if isinstance(code, int) else 0)
