"""How many threads a computation takes, and the work it hands to them."""

import multiprocessing
import os
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from porefv import PoreFlow, Walls
from porefv.system import threads
from porefv.system.threads import for_blocks, for_each, for_rows, limited_threads, thread_count

PACKINGS = Path(__file__).parents[2] / "data" / "packings"


@pytest.fixture
def four(monkeypatch):
    """A machine of four processors, without quota or variables."""
    monkeypatch.setattr(threads, "processors", lambda: 4)
    monkeypatch.setattr(threads, "quota", lambda: sys.maxsize)
    for name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS"):
        monkeypatch.delenv(name, raising=False)
    threads.lasting_limit.cache_clear()
    yield
    threads.lasting_limit.cache_clear()


# ---- how many ----------


@pytest.mark.parametrize(
    ("variables", "expected"),
    [
        ({}, 4), ({"OMP_NUM_THREADS": "3"}, 3), ({"NUMBA_NUM_THREADS": "2"}, 2), ({"OMP_NUM_THREADS": "9"}, 4),
        ({"OMP_NUM_THREADS": "3", "NUMBA_NUM_THREADS": "1"}, 1), ({"OMP_NUM_THREADS": "2,4"}, 2),
        ({"OMP_NUM_THREADS": "many"}, 4), ({"OMP_NUM_THREADS": "0"}, 4), ({"OMP_NUM_THREADS": ""}, 4),
    ],
)  # fmt: skip
def test_the_least_of_all_limits_counts(four, monkeypatch, variables, expected):
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    threads.lasting_limit.cache_clear()
    assert thread_count() == expected
    with limited_threads(2):
        assert thread_count() == min(2, expected)
        with limited_threads(3):  # a limit within a limit does not lift it
            assert thread_count() == min(2, expected)
    assert thread_count() == expected


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="of Linux")
def test_a_process_on_one_processor_takes_one_thread():
    one = min(os.sched_getaffinity(0))
    code = f"import os; os.sched_setaffinity(0, [{one}]); from porefv.system.threads import *; print(thread_count())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "1\n"


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        ({"proc/self/cgroup": "0::/box\n", "sys/fs/cgroup/box/cpu.max": "150000 100000"}, 2),
        ({"proc/self/cgroup": "0::/box\n", "sys/fs/cgroup/box/cpu.max": "50000 100000"}, 1),
        ({"proc/self/cgroup": "0::/box\n", "sys/fs/cgroup/box/cpu.max": "max 100000"}, sys.maxsize),
        # A group around the process's own has the least.
        (
            {"proc/self/cgroup": "0::/a/b\n", "sys/fs/cgroup/a/b/cpu.max": "max 100000",
             "sys/fs/cgroup/a/cpu.max": "300000 100000"}, 3,
        ),
        # In a container the path may be the host's, and only the mount be there.
        ({"proc/self/cgroup": "0::/host/path\n", "sys/fs/cgroup/cpu.max": "200000 100000"}, 2),
        (
            {"proc/self/cgroup": "3:cpu,cpuacct:/job\n", "sys/fs/cgroup/cpu/job/cpu.cfs_quota_us": "400000",
             "sys/fs/cgroup/cpu/job/cpu.cfs_period_us": "100000"}, 4,
        ),
        (
            {"proc/self/cgroup": "3:cpu,cpuacct:/job\n", "sys/fs/cgroup/cpu/job/cpu.cfs_quota_us": "-1",
             "sys/fs/cgroup/cpu/job/cpu.cfs_period_us": "100000"}, sys.maxsize,
        ),
        ({}, sys.maxsize), ({"proc/self/cgroup": "no such line\n"}, sys.maxsize),
        ({"proc/self/cgroup": "0::/box\n", "sys/fs/cgroup/box/cpu.max": "plenty"}, sys.maxsize),
    ],
)  # fmt: skip
def test_the_quota_of_a_control_group(tmp_path, files, expected):
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    assert threads.quota(tmp_path) == expected


# ---- the work ----------


@pytest.mark.parametrize("count", [1, 2, 4])
def test_every_item_is_done_once_and_results_are_in_order(four, count):
    done = []

    def work(item):
        time.sleep(0.001 * (item % 3))
        done.append(item)
        return 10 * item

    with limited_threads(count):
        assert for_each(work, range(20)) == [10 * item for item in range(20)]
    assert sorted(done) == list(range(20))


def test_work_is_shared(four):
    meet = threading.Barrier(2, timeout=20.0)  # two items can only end together
    assert for_each(lambda item: meet.wait() >= 0, range(2)) == [True, True]


@pytest.mark.parametrize("rows", [0, 1, 1024, 100_001])
@pytest.mark.parametrize("count", [1, 3])
def test_ranges_of_rows_are_all_the_rows(four, rows, count):
    hits = np.zeros(rows, int)

    def kernel(first, last, array):
        assert first < last
        array[first:last] += 1

    with limited_threads(count):
        for_rows(kernel, rows, hits)
    assert (hits == 1).all()


def test_blocks_do_not_depend_on_the_number_of_threads(four):
    values = np.random.default_rng(0).random(10_000)

    def total():
        return for_blocks(lambda first, last: float(values[first:last].sum()), len(values), 300)

    found = total()
    with limited_threads(1):
        assert total() == found


@pytest.mark.parametrize("count", [1, 2])
def test_an_error_of_the_work_is_raised_and_ends_it(four, count):
    done = []

    def work(item):
        if item == 3:
            raise ZeroDivisionError("at 3")
        time.sleep(0.005)
        done.append(item)

    with limited_threads(count), pytest.raises(ZeroDivisionError, match="at 3"):
        for_each(work, range(200))
    assert len(done) < 20


def test_a_call_within_work_that_is_shared_ends(four):
    assert for_each(lambda i: sum(for_each(lambda j: i * j, range(5))), range(8)) == [10 * i for i in range(8)]


def test_nobody_waits_for_a_thread_that_has_not_begun(four):
    # All threads of the pool are busy: the caller does the work alone.
    release = threading.Event()
    busy = [threads.pool().submit(release.wait) for _ in range(os.cpu_count())]
    try:
        begin = time.perf_counter()
        assert for_each(lambda item: item, range(4)) == list(range(4))
        assert time.perf_counter() - begin < 5.0
    finally:
        release.set()
        for future in busy:
            future.result()


POOL = """
import multiprocessing, sys
from porefv import Packing, PoreFlow, Walls

def permeability(path):
    return PoreFlow(Packing.read(path), Walls.along("y")).permeability

if __name__ == "__main__":
    expected = permeability(sys.argv[2])
    with multiprocessing.get_context(sys.argv[1]).Pool(2) as pool:
        print(pool.map(permeability, [sys.argv[2]] * 3) == [expected] * 3)
"""


@pytest.mark.parametrize("method", multiprocessing.get_all_start_methods())
def test_a_process_made_from_one_that_has_computed_computes(method, tmp_path):
    script = tmp_path / "script.py"
    script.write_text(POOL)
    command = [sys.executable, str(script), method, str(PACKINGS / "n5000_s1.csv")]
    assert subprocess.run(command, capture_output=True, text=True, timeout=120).stdout == "True\n"


def test_eight_threads_ask_one_flow_at_once(four, reference):
    expected = PoreFlow(reference("n2000_s1"), Walls.along("y"))
    flow = PoreFlow(reference("n2000_s1"), Walls.along("y"))
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda name: getattr(flow, name), ["permeability", "pressure", "forces", "inflow"] * 2))
    assert found[0] == found[4] == expected.permeability
    assert np.array_equal(found[1], expected.pressure) and np.array_equal(found[6].total, expected.forces.total)


def test_ctrl_c_ends_a_computation_between_blocks(four):
    begun = threading.Event()
    count = 0

    def work(item):
        nonlocal count
        count += 1
        if item == 0:
            raise KeyboardInterrupt
        begun.set()
        time.sleep(0.01)

    with pytest.raises(KeyboardInterrupt):
        for_each(work, range(1000))
    assert count < 50


def test_flows_are_the_same_to_the_bit_on_any_number_of_threads(four, reference):
    def found(count):
        with limited_threads(count):
            flow = PoreFlow(reference("n20000_s1"), Walls.along("y"))
            return flow.permeability, flow.pressure, flow.forces.total, flow.forces.wall_total

    one, two, three = found(1), found(2), found(3)
    for other in (two, three):
        for a, b in zip(one, other, strict=True):
            assert np.array_equal(a, b)
