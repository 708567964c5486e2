"""A file is the old one or the new one, at every moment."""

from __future__ import annotations

import errno
import os
import signal
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from steptwin.errors import Misuse
from steptwin.files import writing
from steptwin.files.textfiles import check_writable, write_bytes

OLD, NEW = b"the old one" * 1000, b"the new one" * 999
STEPS: list[tuple[object, str]] = [
    (os, "open"),
    (os, "fdopen"),
    (os, "fchmod"),
    (os, "fsync"),
    (Path, "replace"),
    (writing, "sync_directory"),
]
"""Where a write reaches the disk, in their order."""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "a.prg"
    path.write_bytes(OLD)
    path.chmod(0o640)
    return path


@pytest.mark.parametrize(("of", "name"), STEPS)
@pytest.mark.parametrize("fails", [errno.ENOSPC, errno.EIO, errno.EACCES])
def test_a_step_that_fails_leaves_the_old_file(
    file: Path, monkeypatch: pytest.MonkeyPatch, of: object, name: str, fails: int
) -> None:
    def failing(*_: object, **__: object) -> None:
        raise OSError(fails, "")

    with monkeypatch.context() as patch:
        patch.setattr(of, name, failing)
        with pytest.raises(Misuse, match=f"cannot write {file}: {os.strerror(fails).lower()}"):
            write_bytes(file, NEW)
    assert file.read_bytes() == (NEW if name == "sync_directory" else OLD)
    if name not in {"fdopen", "open"}:
        assert os.listdir(file.parent) == ["a.prg"]


KILLED = """
import os, signal, sys
from pathlib import Path
from steptwin.files import writing
from steptwin.files.textfiles import write_bytes

name, path = sys.argv[1], Path(sys.argv[2])
of = {"replace": Path, "sync_directory": writing}.get(name, os)
for is_after in (False, True):
    path.write_bytes(b"old" * 1000)
    path.chmod(0o640)
    child = os.fork()
    if child == 0:
        real = getattr(of, name)

        def step(*given, **named):
            done = real(*given, **named) if is_after else None
            os.kill(os.getpid(), signal.SIGKILL)

        setattr(of, name, step)
        write_bytes(path, b"new" * 999)
    end = os.waitpid(child, 0)[1]
    content = path.read_bytes()
    whole = {b"old" * 1000: "old", b"new" * 999: "new"}.get(content, f"{len(content)} bytes")
    print(os.WTERMSIG(end), whole, oct(path.stat().st_mode & 0o777))
"""


@pytest.mark.parametrize(("at", "name"), list(enumerate(["open", "fdopen", "fchmod", "fsync", "replace", "sync_directory"])))
def test_kill_9_before_and_after_each_step_leaves_one_of_both_whole(tmp_path: Path, at: int, name: str) -> None:
    child = [sys.executable, "-c", KILLED, name, str(tmp_path / "a.prg")]
    said = subprocess.run(child, check=True, capture_output=True, text=True).stdout.splitlines()
    before, after = ("old", "old") if at < 4 else ("old", "new") if name == "replace" else ("new", "new")
    assert said == [f"{int(signal.SIGKILL)} {whole} 0o640" for whole in (before, after)]


def test_a_disk_that_is_full(file: Path, tmp_path: Path) -> None:
    """A real one, where this process may mount it."""
    place = tmp_path / "small"
    place.mkdir()
    if subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=16k", "none", str(place)], check=False, capture_output=True
    ).returncode:
        pytest.skip("this process may not mount")
    try:
        path = place / "a.prg"
        write_bytes(path, OLD[:9000])
        with pytest.raises(Misuse, match=f"cannot write {path}: no space left on device"):
            write_bytes(path, NEW)
        assert path.read_bytes() == OLD[:9000]
        assert os.listdir(place) == ["a.prg"]
    finally:
        subprocess.run(["umount", str(place)], check=True)


def test_mode_owner_and_attributes_are_kept(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    try:
        os.setxattr(file, "user.note", b"mine")
    except OSError:
        pytest.skip("this file system has no attributes")
    if os.getuid() == 0:
        os.chown(file, 1234, 1235)
        file.chmod(0o4640)
    before = file.stat()
    write_bytes(file, NEW)
    after = file.stat()
    assert (after.st_mode, after.st_uid, after.st_gid) == (before.st_mode, before.st_uid, before.st_gid)
    assert os.getxattr(file, "user.note") == b"mine"

    def refused(*_: object) -> None:
        raise PermissionError(errno.EPERM, "")

    with monkeypatch.context() as patch:
        patch.setattr(os, "setxattr", refused)
        with pytest.raises(Misuse, match=r"its attribute user\.note could not be kept"):
            write_bytes(file, OLD)
    if os.getuid() == 0:
        monkeypatch.setattr(os, "fchown", refused)
        with pytest.raises(Misuse, match="its owner 1234 and group 1235 could not be kept"):
            write_bytes(file, OLD)
    assert file.read_bytes() == NEW


def test_a_new_file_has_the_permissions_of_any_other(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        write_bytes(tmp_path / "new" / "a.prg", NEW)
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "new" / "a.prg").stat().st_mode) == 0o640
    with writing.new_content(tmp_path / "key", writing.PRIVATE) as key:
        key.write(b"secret")
    assert stat.S_IMODE((tmp_path / "key").stat().st_mode) == 0o600


def test_the_target_of_a_link_is_replaced(file: Path, tmp_path: Path) -> None:
    far = tmp_path / "far"
    far.mkdir()
    (far / "second").symlink_to("../a.prg")
    (tmp_path / "first").symlink_to(far / "second")
    write_bytes(tmp_path / "first", NEW)
    assert file.read_bytes() == NEW
    assert (tmp_path / "first").is_symlink()
    assert (far / "second").is_symlink()
    (tmp_path / "round").symlink_to("round")
    with pytest.raises(Misuse, match=r"cannot write .*round: too many levels of symbolic links"):
        write_bytes(tmp_path / "round", NEW)
    (tmp_path / "dangling").symlink_to("there")
    write_bytes(tmp_path / "dangling", NEW)
    assert (tmp_path / "there").read_bytes() == NEW


@pytest.mark.parametrize("protected", ["folder", "file"])
def test_what_is_protected_is_refused_before_and_when_it_is_written(
    file: Path, monkeypatch: pytest.MonkeyPatch, protected: str
) -> None:
    """The superuser may write everywhere, so that the answer of the system is made up."""
    refused = file if protected == "file" else file.parent
    real = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != refused and real(path, mode))
    why = "permission denied" if protected == "file" else "it can only be replaced as a whole, and its folder takes no new file"
    for act in (lambda: check_writable(file), lambda: write_bytes(file, NEW)):
        with pytest.raises(Misuse, match=f"cannot write {file}: {why}"):
            act()
    assert file.read_bytes() == OLD
    if protected == "folder":
        with pytest.raises(Misuse, match="permission denied"):
            check_writable(file.parent / "sub" / "new")


def test_pipes_and_devices_are_written_directly(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(Misuse, match=f"cannot write {pipe}: no such device or address"):
        write_bytes(pipe, NEW)  # nobody reads
    number = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_bytes(pipe, NEW)
    assert os.read(number, len(NEW) + 1) == NEW
    os.close(number)
    write_bytes(Path("/dev/null"), NEW)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    with pytest.raises(Misuse, match="cannot write /dev/full: no space left on device"):
        write_bytes(Path("/dev/full"), NEW)
    with pytest.raises(Misuse, match="is a directory"):
        write_bytes(tmp_path, NEW)


@pytest.mark.parametrize("redirection", [">", ">>", "| cat >"])
def test_standard_output_follows_what_was_printed(tmp_path: Path, redirection: str) -> None:
    """Whatever it is: a pipe, or a file at whose end others write, too."""
    (tmp_path / "out").write_text("before\n")
    python = 'from steptwin.files.textfiles import write_bytes; from pathlib import Path; print("one"); '
    python += 'write_bytes(Path("/dev/stdout"), b"two\\n"); print("three")'
    subprocess.run(["sh", "-c", f"{sys.executable} -c '{python}' {redirection} out"], cwd=tmp_path, check=True)
    assert (tmp_path / "out").read_text() == ("before\n" if redirection == ">>" else "") + "one\ntwo\nthree\n"


def test_another_name_of_the_file_keeps_the_old_content(file: Path, tmp_path: Path) -> None:
    os.link(file, tmp_path / "copy")
    write_bytes(file, NEW)
    assert (tmp_path / "copy").read_bytes() == OLD
