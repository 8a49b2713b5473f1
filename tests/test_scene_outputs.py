"""Commands of `mitsuba_scenes` check their outputs before rendering."""

import argparse
import os

import needs
import pytest

from mitsuba_scenes import demo, files, render
from mitsuba_scenes.crosscheck import __main__ as crosscheck
from mitsuba_scenes.outputs import output_file, output_folder


def refusal(convert, path):
    """The message that refuses a path."""
    with pytest.raises(argparse.ArgumentTypeError) as refused:
        convert(str(path))
    return str(refused.value)


@pytest.fixture
def taken(tmp_path):
    """A folder that holds a file, and folders with names of files."""
    (tmp_path / "file").write_text("years of work")
    (tmp_path / "a.exr").mkdir()
    (tmp_path / "b.png").mkdir()
    return tmp_path


def contents(folder):
    return sorted((path.name, path.is_file() and path.read_bytes()) for path in folder.iterdir())


def test_unwritable_files_are_refused_unchanged(taken):
    before = contents(taken)
    picture = output_file(".exr", beside=(".png",))
    for name, reason in [
        ("c.png", "must end in .exr"),
        ("c", "must end in .exr"),
        ("a.exr", "is a folder"),
        ("b.exr", "b.png is a folder"),
        ("file/c.exr", "is no folder"),
        ("file/new/c.exr", "file is no folder"),
        (f"{'c' * 300}.exr", "too long"),
        ("/proc/new/c.exr", "cannot be written"),
    ]:
        assert reason in refusal(picture, taken / name), name
    for name in ("c.exr", "C.EXR", "new/folder/c.exr"):
        assert picture(str(taken / name)) == taken / name
    assert contents(taken) == before


def test_unwritable_folders_are_refused_and_not_made(taken):
    before = contents(taken)
    for name, reason in [("file", "file is no folder"), ("file/new", "file is no folder"), ("/proc/new", "cannot")]:
        assert reason in refusal(output_folder, taken / name), name
    for name in ("", "new", "new/folder"):
        assert output_folder(str(taken / name)) == taken / name
    assert contents(taken) == before


def test_files_without_permission_are_refused(taken):
    if os.geteuid() == 0:
        needs.skip("user", "root may write anywhere")
    (taken / "kept.exr").write_text("years of work")
    (taken / "kept.exr").chmod(0o444)
    taken.chmod(0o555)
    for name in ("kept.exr", "new.exr"):
        assert "Permission denied" in refusal(output_file(".exr"), taken / name)
    taken.chmod(0o755)


@pytest.mark.parametrize("command", [demo, files, crosscheck, render])
def test_every_command_checks_its_output(command, taken, capsys):
    with pytest.raises(SystemExit) as left:
        command.main(["-o", str(taken / "file" / "c.exr")])
    assert left.value.code == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert "--output" in last
    assert "file is no folder" in last
