"""A PostgreSQL server of the test's own, which can be killed and started again."""

from __future__ import annotations

import contextlib
import os
import pwd
import shutil
import socket
import subprocess
import tempfile
from collections.abc import Generator
from pathlib import Path

from tests.conftest import until

ACCOUNT = "postgres"
"""A server does not run as root; Debian's package has this account."""


def programs() -> Path | None:
    """The folder with the programs of the newest installed server; None without one."""
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"))
    return found[-1].parent if found else None


class PostgresServer:
    """Data in ``folder``, on a free port of 127.0.0.1."""

    def __init__(self, where: Path, folder: Path) -> None:
        self._where = where
        self._data = folder / "data"
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            self.port = taken.getsockname()[1]
        self._process: subprocess.Popen[bytes] | None = None
        self._run("initdb", "-D", str(self._data), "-U", ACCOUNT, "-A", "trust", "--no-sync", "-E", "UTF8", "--locale=C")

    @property
    def url(self) -> str:
        return f"postgresql://{ACCOUNT}@127.0.0.1:{self.port}/postgres"

    def start(self) -> None:
        options = {"listen_addresses": "127.0.0.1", "port": self.port, "unix_socket_directories": "", "max_connections": 20}
        arguments = [word for name, value in options.items() for word in ("-c", f"{name}={value}")]
        command = [str(self._where / "postgres"), "-D", str(self._data), *arguments]
        self._process = subprocess.Popen(
            self._as_account(command), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=self._data.parent
        )
        until(self._answers, "PostgreSQL answers")

    def _answers(self) -> bool:
        try:
            socket.create_connection(("127.0.0.1", self.port)).close()
        except OSError:
            return False
        command = [str(self._where / "pg_isready"), "-q", "-h", "127.0.0.1", "-p", str(self.port)]
        return subprocess.run(command, check=False).returncode == 0

    def crash(self) -> None:
        """All its processes end at once, without writing anything; the next start has to recover."""
        self._run("pg_ctl", "stop", "-D", str(self._data), "-m", "immediate", "-w")
        if self._process is not None:
            self._process.wait(30)
            self._process = None

    def query(self, statement: str) -> str:
        """The output of psql, a program of its own."""
        command = [str(self._where / "psql"), "-h", "127.0.0.1", "-p", str(self.port), "-U", ACCOUNT, "-AtX", "-c", statement]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()

    def _run(self, program: str, *arguments: str) -> None:
        command = self._as_account([str(self._where / program), *arguments])
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, cwd=self._data.parent)

    @staticmethod
    def _as_account(command: list[str]) -> list[str]:
        return ["runuser", "-u", ACCOUNT, "--", *command] if os.geteuid() == 0 else command


@contextlib.contextmanager
def postgres_server(where: Path) -> Generator[PostgresServer]:
    folder = Path(tempfile.mkdtemp(prefix="steptwin-postgres-"))
    try:
        if os.geteuid() == 0:
            account = pwd.getpwnam(ACCOUNT)
            os.chown(folder, account.pw_uid, account.pw_gid)
        server = PostgresServer(where, folder)
        server.start()
        try:
            yield server
        finally:
            with contextlib.suppress(subprocess.CalledProcessError):  # a test may have ended it
                server.crash()
    finally:
        shutil.rmtree(folder, ignore_errors=True)
