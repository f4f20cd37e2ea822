import os
import stat

import pytest

from porefv.errors import InputError
from porefv.system.atomic_files import atomic_directory, atomic_write

posix = pytest.mark.skipif(os.name != "posix", reason="permissions and links of POSIX")


class FailureError(Exception):
    pass


def results(directory, value="old"):
    directory.mkdir()
    (directory / "summary.json").write_text(value)
    (directory / "stale.vtu").write_text(value)


def content(directory):
    return {path.name: path.read_text() for path in directory.iterdir()}


# Files


def test_a_file_appears_when_the_block_ends(tmp_path):
    with atomic_write(tmp_path / "a.vtp") as temporary:
        temporary.write_text("new")
        assert not (tmp_path / "a.vtp").exists() and temporary.suffix == ".vtp"
    assert content(tmp_path) == {"a.vtp": "new"}


@pytest.mark.parametrize("failure", [FailureError, KeyboardInterrupt])
def test_a_failed_block_leaves_what_existed_and_nothing_else(tmp_path, failure):
    (tmp_path / "a").write_text("old")
    with pytest.raises(failure), atomic_write(tmp_path / "a") as temporary:
        temporary.write_text("half")
        raise failure
    assert content(tmp_path) == {"a": "old"}


def test_an_error_of_the_system_names_the_file(tmp_path):
    with (
        pytest.raises(InputError, match="cannot write .*no/a.csv"),
        atomic_write(tmp_path / "no" / "a.csv") as path,
    ):
        path.write_text("x")
    with pytest.raises(InputError, match="cannot write .*a.csv"), atomic_write(tmp_path / "a.csv"):
        pass  # a writer that wrote nothing
    with pytest.raises(InputError, match="is a directory"), atomic_write(tmp_path):
        pass


@posix
def test_the_root_of_the_file_system_is_not_replaced():
    for write in (atomic_write, atomic_directory):
        with pytest.raises(InputError), write("/"):
            pass


@posix
def test_a_device_is_not_replaced():
    with pytest.raises(InputError, match="not a regular file"), atomic_write("/dev/null"):
        pass
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)


@posix
def test_permissions_are_the_usual_ones_and_links_are_followed(tmp_path):
    (tmp_path / "usual").write_text("")
    (tmp_path / "link").symlink_to(tmp_path / "target")
    with atomic_write(tmp_path / "link") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "target").read_text() == "new"
    assert (tmp_path / "target").stat().st_mode == (tmp_path / "usual").stat().st_mode


# Directories


def test_a_directory_appears_with_its_parents_when_the_block_ends(tmp_path):
    target = tmp_path / "runs" / "first"
    with atomic_directory(target) as temporary:
        (temporary / "summary.json").write_text("new")
        assert not target.exists()
    assert content(target) == {"summary.json": "new"} and os.listdir(target.parent) == ["first"]


def test_an_empty_directory_is_filled(tmp_path):
    (tmp_path / "results").mkdir()
    with atomic_directory(tmp_path / "results") as temporary:
        (temporary / "a").write_text("new")
    assert content(tmp_path / "results") == {"a": "new"} and os.listdir(tmp_path) == ["results"]


def test_results_are_replaced_only_with_force(tmp_path):
    target = tmp_path / "results"
    results(target)
    with pytest.raises(InputError, match="already holds results.*--force"), atomic_directory(target):
        pytest.fail("refused before anything is computed")
    assert content(target) == {"summary.json": "old", "stale.vtu": "old"}
    with atomic_directory(target, force=True) as temporary:
        (temporary / "summary.json").write_text("new")
    assert content(target) == {"summary.json": "new"} and os.listdir(tmp_path) == ["results"]


@pytest.mark.parametrize("force", [False, True])
def test_other_files_are_never_replaced(tmp_path, force):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(InputError, match="not results of porefv"), atomic_directory(tmp_path, force=force):
        pass
    with (
        pytest.raises(InputError, match="a file of that name"),
        atomic_directory(tmp_path / "thesis.tex", force=force),
    ):
        pass
    assert content(tmp_path) == {"thesis.tex": "years of work"}


@pytest.mark.parametrize("failure", [FailureError, KeyboardInterrupt])
def test_a_failed_block_leaves_results_as_they_were(tmp_path, failure):
    results(tmp_path / "results")
    for target in (tmp_path / "results", tmp_path / "runs" / "deep" / "first"):
        with pytest.raises(failure), atomic_directory(target, force=True) as temporary:
            (temporary / "summary.json").write_text("half")
            raise failure
    assert content(tmp_path / "results") == {"summary.json": "old", "stale.vtu": "old"}
    assert os.listdir(tmp_path) == ["results"]


def test_results_that_appear_meanwhile_are_not_replaced(tmp_path):
    with (
        pytest.raises(InputError, match="already holds"),
        atomic_directory(tmp_path / "results") as temporary,
    ):
        (temporary / "summary.json").write_text("second")
        results(tmp_path / "results", "first")
    assert content(tmp_path / "results")["summary.json"] == "first" and os.listdir(tmp_path) == ["results"]


def test_a_swap_that_fails_puts_the_old_results_back(tmp_path, monkeypatch):
    results(tmp_path / "results")
    rename, calls = os.rename, []

    def fail_once(source, target):
        calls.append(source)
        if len(calls) == 2:
            raise OSError(28, "No space left on device")
        rename(source, target)

    monkeypatch.setattr(os, "rename", fail_once)
    with pytest.raises(InputError, match="No space left"), atomic_directory(tmp_path / "results", force=True):
        pass
    assert content(tmp_path / "results")["summary.json"] == "old" and os.listdir(tmp_path) == ["results"]


def test_a_name_the_system_refuses_is_an_error_that_names_it(tmp_path):
    for write in (atomic_write, atomic_directory):
        with pytest.raises(InputError, match="cannot write .*aaa"), write(tmp_path / ("a" * 5000)):
            pytest.fail("refused before anything is computed")


def test_a_place_that_cannot_be_written_is_refused_before_the_block(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot write"), atomic_directory(tmp_path / "file" / "results"):
        pytest.fail("refused before anything is computed")
