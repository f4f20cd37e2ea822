"""Optional packages are loaded whole, or said to be missing."""

import signal
import subprocess
import sys
import threading

import pytest

from porefv.errors import MissingExtraError
from porefv.system import optional_imports


@pytest.fixture
def interrupted(tmp_path, monkeypatch):
    """A package whose loading is interrupted by Ctrl-C."""
    (tmp_path / "half_loaded.py").write_text("import signal\nsignal.raise_signal(signal.SIGINT)\nwhole = True\n")
    monkeypatch.syspath_prepend(tmp_path)
    yield
    sys.modules.pop("half_loaded", None)


def test_an_interruption_waits_until_a_package_is_loaded(interrupted):
    with pytest.raises(KeyboardInterrupt):
        optional_imports.load("half_loaded", "This test")
    assert sys.modules["half_loaded"].whole
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_packages_load_in_any_thread():
    found = []
    thread = threading.Thread(target=lambda: found.append(optional_imports.load("json", "This test")))
    thread.start()
    thread.join()
    assert found[0].__name__ == "json"


def test_a_missing_package_is_said_to_be_missing():
    with pytest.raises(MissingExtraError, match="This test needs the package pyvista"):
        optional_imports.load("vtkmodules.no_such_module", "This test")


def test_interruptions_that_are_ignored_stay_so():
    code = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN); from porefv.system import optional_imports; "
    code += (
        "optional_imports.load('vtkmodules.vtkCommonCore', ''); signal.raise_signal(signal.SIGINT); print('ignored')"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True) == "ignored\n"
