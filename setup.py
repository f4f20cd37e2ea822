"""What setup.cfg cannot say: kernels are compiled when the package is built, so that nobody waits for them later."""

import os
import subprocess
import sys
from pathlib import Path
from typing import ClassVar

from setuptools import Command, Distribution, setup
from setuptools.command.build import build


class BuildKernels(Command):
    """Compile the recorded kernels into the package that is built; a working copy compiles what it uses."""

    user_options: ClassVar = []
    editable_mode = False

    def initialize_options(self) -> None:
        self.build_lib = None

    def finalize_options(self) -> None:
        self.set_undefined_options("build", ("build_lib", "build_lib"))

    @property
    def _folder(self) -> Path:
        return Path(self.build_lib).resolve() / "porefv" / "compiled_kernels"

    def run(self) -> None:
        if self.editable_mode:
            return
        # In an isolated build the variable has the build's requirements.
        paths = [str(Path(self.build_lib).resolve()), *filter(None, [os.environ.get("PYTHONPATH")])]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
        command = [sys.executable, "-m", "porefv.system.kernel_build", str(self._folder)]
        subprocess.run(command, env=environment, check=True)

    def get_source_files(self) -> list[str]:
        return []

    def get_outputs(self) -> list[str]:
        return [] if self.editable_mode else [str(path) for path in self._folder.glob("*")]

    def get_output_mapping(self) -> dict[str, str]:
        return {}


class Build(build):
    """Python files first, then the kernels in them."""

    sub_commands: ClassVar = [*build.sub_commands, ("build_kernels", None)]


class PlatformDistribution(Distribution):
    """A wheel with compiled kernels is for one platform and one version of Python."""

    def has_ext_modules(self) -> bool:
        return True


setup(distclass=PlatformDistribution, cmdclass={"build": Build, "build_kernels": BuildKernels})
