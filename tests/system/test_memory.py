"""What memory may be taken: of the machine, of the control groups around the process, of the process's own limits."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from porefv.packing import memory_estimate
from porefv.packing.box import Box
from porefv.packing.packing import Packing
from porefv.system import memory

GIB = 2**30
MACHINE = 8 * GIB
linux = pytest.mark.skipif(sys.platform != "linux", reason="limits and files of Linux")


@pytest.fixture
def system(tmp_path):
    """A function that writes files of /proc and /sys below a root, of a machine that has 8 GiB free."""

    def written(files):
        meminfo = {"proc/meminfo": f"MemTotal: 99999999 kB\nMemAvailable: {MACHINE // 1024} kB\n"}
        for name, text in (meminfo | files).items():
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(str(text))
        return tmp_path

    return written


def group(folder, limit, used, files=0):
    """Files of a group, version 2."""
    stat = f"anon {used - files}\nfile {files}\nactive_file 0\ninactive_file {files}\n"
    return {f"{folder}/memory.max": limit, f"{folder}/memory.current": used, f"{folder}/memory.stat": stat}


def test_without_any_limit_it_is_what_the_machine_has(system):
    assert memory.available(system({})) == MACHINE
    free = {"proc/self/cgroup": "0::/\n"} | group("sys/fs/cgroup/job", 1 * GIB, 0)  # a group of others
    assert memory.available(system(free)) == MACHINE


def test_a_container_leaves_its_limit_less_what_it_uses_but_for_pages_of_files(system):
    own = group("sys/fs/cgroup/box", 2 * GIB, 1 * GIB, files=GIB // 4)
    assert memory.available(system({"proc/self/cgroup": "0::/box\n"} | own)) == 1.25 * GIB


def test_every_group_on_the_way_up_counts(system):
    line = {"proc/self/cgroup": "0::/batch/job/step\n"}
    groups = group("sys/fs/cgroup/batch", 6 * GIB, 5 * GIB) | group("sys/fs/cgroup/batch/job", 4 * GIB, 1 * GIB)
    assert memory.available(system(line | groups | group("sys/fs/cgroup/batch/job/step", "max", 1))) == 1 * GIB


def test_within_a_container_that_sees_only_itself_the_mount_counts(system):
    # The path is the host's, or leads out of what is mounted.
    for path in ("/docker/0123abc", "/../../job"):
        files = {"proc/self/cgroup": f"0::{path}\n"} | group("sys/fs/cgroup", 3 * GIB, 1 * GIB)
        assert memory.available(system(files)) == 2 * GIB


def test_groups_of_version_one_count_too(system):
    folder = "sys/fs/cgroup/memory"
    files = {
        "proc/self/cgroup": "5:cpu,cpuacct:/job\n4:memory:/job\n1:name=systemd:/\n0::/\n",
        f"{folder}/job/memory.limit_in_bytes": 2 * GIB,
        f"{folder}/job/memory.usage_in_bytes": 1 * GIB,
        f"{folder}/job/memory.stat": f"inactive_file 0\ntotal_inactive_file {GIB // 2}\n",
        f"{folder}/memory.limit_in_bytes": 9223372036854771712,  # none
        f"{folder}/memory.usage_in_bytes": 7 * GIB,
        f"{folder}/memory.stat": "total_inactive_file 0\n",
    }
    assert memory.available(system(files)) == 1.5 * GIB


def test_a_group_that_is_over_its_limit_leaves_nothing(system):
    files = {"proc/self/cgroup": "0::/box\n"} | group("sys/fs/cgroup/box", 1 * GIB, 2 * GIB)
    assert memory.available(system(files)) == 0


def test_files_that_cannot_be_understood_are_passed_over(system):
    files = {"proc/self/cgroup": "0::/box\n"} | group("sys/fs/cgroup/box", "plenty", 1)
    assert memory.available(system(files)) == MACHINE
    assert memory.available(system({"proc/self/cgroup": "no such line\n"})) == MACHINE


# ---- limits of the process -----------------------------------------------------------------------------------

LIMITED = """
import os, resource, sys
os.sched_setaffinity(0, [min(os.sched_getaffinity(0))])  # one thread, on any machine
limit = getattr(resource, sys.argv.pop(1))
resource.setrlimit(limit, (int(sys.argv[1]), resource.getrlimit(limit)[1]))
del sys.argv[1]
"""
AVAILABLE = LIMITED + "from porefv.system import memory; print(memory.available())"
SOLVE = LIMITED + "from porefv.cli.program import main; sys.exit(main(sys.argv[1:]))"


def run(code, *arguments):
    command = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


@linux
@pytest.mark.parametrize("limit", ["RLIMIT_AS", "RLIMIT_DATA"])
def test_limits_of_the_process_count(limit):
    # A GiB more of the limit is a GiB more to be taken, and what libraries reserve is left out.
    less, more = (int(run(AVAILABLE, limit, size).stdout) for size in (3 * GIB // 2, 3 * GIB // 2 + 2**26))
    assert less < 1.5 * GIB and more - less == 2**26
    assert int(run(AVAILABLE, limit, 10 * 2**20 + 2**26).stdout) == 0


@pytest.fixture
def scene(tmp_path):
    """A scene of so many spheres."""

    def written(n):
        centres = np.random.default_rng(0).uniform(0.1, 0.9, (n, 3))
        Packing(centres, np.full(n, 1e-6), Box([0.0999] * 3, [0.9001] * 3)).write(tmp_path / "grains.csv")
        text = 'packing = "grains.csv"\n[walls]\ny_min = { pressure = 1.0 }\ny_max = { pressure = 0.0 }\n'
        (tmp_path / "scene.toml").write_text(text)
        return tmp_path / "scene.toml"

    return written


@linux
@pytest.mark.parametrize("limit", ["RLIMIT_AS", "RLIMIT_DATA"])
def test_where_libraries_have_no_room_that_is_said_before_they_are_loaded(scene, limit):
    # Some hang without it, others end the process.
    path = scene(8)
    done = run(SOLVE, limit, 200 * 2**20, "solve", path)
    assert done.returncode == 1
    assert done.stderr.startswith("porefv: error: porefv itself needs 200 MiB of memory, ")
    assert len(done.stderr.splitlines()) == 1
    assert sorted(p.name for p in path.parent.iterdir()) == ["grains.csv", "scene.toml"]


@linux
def test_a_packing_for_which_the_limit_leaves_no_room_is_refused_before_work_starts(scene):
    path = scene(100_000)
    # Room for everything that is loaded, and half of what the spheres need.
    spare = int(run(AVAILABLE, "RLIMIT_AS", 2 * GIB).stdout)
    limit = 2 * GIB - spare + memory_estimate.required(50_000)
    done = run(SOLVE, "RLIMIT_AS", limit, "solve", path)
    assert done.returncode == 1
    assert done.stderr.startswith("porefv: error: 100000 spheres need about 848 MiB of memory, "), done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert sorted(p.name for p in path.parent.iterdir()) == ["grains.csv", "scene.toml"]


MIDWAY = """
import resource, sys
from pathlib import Path
from porefv import cli
from porefv.packing import memory_estimate
from porefv.system import memory
assert cli.main(["solve", sys.argv[1], "--quiet", "--threads", "1"]) == 0  # every library and kernel is loaded
memory.available = memory_estimate.available = lambda: None  # the estimate lets everything pass
size = resource.getpagesize() * int(Path("/proc/self/statm").read_text().split()[0])
resource.setrlimit(resource.RLIMIT_AS, (size + int(sys.argv[3]) * 2**20,) * 2)
sys.exit(cli.main(["solve", sys.argv[2], "--quiet", "--force", "--threads", "1"]))
"""


@linux
@pytest.mark.parametrize("room", [0, 5, 25])
def test_memory_that_runs_out_midway_is_said_and_loses_nothing(tmp_path, room):
    packings = Path(__file__).parents[2] / "data" / "packings"
    for name in ("n2000_s1", "n20000_s1"):
        text = f'packing = "{(packings / name).as_posix()}.csv"\n[walls]\ny_min.pressure = 1.0\ny_max.pressure = 0.0\n'
        (tmp_path / f"{name}.toml").write_text(text + '[output]\nquantities = ["permeability", "forces"]\n')
    done = run(MIDWAY, tmp_path / "n2000_s1.toml", tmp_path / "n20000_s1.toml", room)
    assert done.returncode == 1
    assert done.stderr.startswith("porefv: error: not enough memory"), done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert sorted(p.name for p in tmp_path.iterdir()) == ["n20000_s1.toml", "n2000_s1.toml", "results"]
    assert '"spheres": 2000,' in (tmp_path / "results" / "summary.json").read_text()
