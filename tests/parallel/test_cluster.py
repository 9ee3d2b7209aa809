"""`parallel_map` over a real Dask cluster: a scheduler and two workers, started with Dask's own commands."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from distributed import Client

import brushgs as bg
from brushgs import __version__, cli
from brushgs.formats.scenes.read import open_files
from brushgs.options.sequence import SequenceConfig
from brushgs.pipeline.blocks.budget import Budget
from brushgs.pipeline.blocks.load import load_in_blocks
from brushgs.pipeline.parallel import connection, parallel_map
from brushgs.pipeline.parallel import dask_cluster as cluster
from tests.kit import programs
from tests.kit.for_each import for_each
from tests.parallel import work
from tests.parallel.conftest import NUM_FRAMES, run_script
from tests.scenes import still_life_of


def start(folder, name, *words):
    """One of Dask's commands, with its output in a file."""
    with (folder / f"{name}.log").open("w") as log:
        options = {"cwd": folder, "stdout": log, "stderr": log, "start_new_session": True}
        return programs.start("-m", "dask", name.split("-")[0], "--no-dashboard", *words, **options)


def stop(process):
    """Kill a command and all that it started."""
    if process.poll() is not None:
        return
    os.killpg(process.pid, signal.SIGTERM)
    try:
        process.wait(timeout=30)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def address_in(path):
    limit = time.monotonic() + 60
    while time.monotonic() < limit:
        if path.exists() and path.read_text().endswith("}"):
            return json.loads(path.read_text())["address"]
        time.sleep(0.02)
    raise TimeoutError(f"no scheduler wrote {path}")


@pytest.fixture(scope="module")
def clusters(tmp_path_factory):
    """Two clusters: one whose two workers are restarted when they die, and a frail one with one worker."""
    folder = tmp_path_factory.mktemp("dask")
    scheduler = ["--host", "127.0.0.1", "--port", "0", "--scheduler-file"]
    worker = ["--nthreads", "1", "--local-directory", str(folder), "--scheduler-file"]
    words = {"scheduler": [*scheduler, "firm.json"], "worker": [*worker, "firm.json", "--nworkers", "2"]}
    words["scheduler-frail"] = [*scheduler, "frail.json"]
    words["worker-frail"] = [*worker, "frail.json", "--no-nanny"]
    running = {name: start(folder, name, *some) for name, some in words.items()}
    yield folder, running
    for process in reversed(running.values()):
        stop(process)


@pytest.fixture(scope="module")
def watch(clusters):
    """A client beside those of `parallel_map`, when both workers are there."""
    with Client(address_in(clusters[0] / "firm.json"), set_as_default=False) as client:
        client.wait_for_workers(2, timeout=60)
        yield client


@pytest.fixture
def address(watch):
    """Address of the cluster, when both workers are there; afterwards it must be as it was."""
    watch.wait_for_workers(2, timeout=60)
    yield watch.scheduler.address
    watch.wait_for_workers(2, timeout=60)
    wait_until(lambda: watch.run_on_scheduler(num_left) == (0, 1))


def num_left(dask_scheduler):
    """Tasks and clients; this function's own client is one of them, those for Dask's events are not."""
    clients = [name for name in dask_scheduler.clients if name.startswith("Client")]
    return len(dask_scheduler.tasks), len(clients)


def wait_until(is_so):
    limit = time.monotonic() + 60
    while not is_so():
        assert time.monotonic() < limit
        time.sleep(0.02)


def test_blocks_of_a_scene_larger_than_memory_are_summed_to_the_same_bits(address, tmp_path):
    path = tmp_path / "pears.ply"
    bg.save(still_life_of(3000), path)
    files, budget = open_files(path, None), Budget(1 << 20)
    configs = SequenceConfig(), SequenceConfig(scheduler=address)
    here, there = (load_in_blocks(files, None, budget, one, block_rows=500)[0] for one in configs)
    for name, column in here.columns().items():
        np.testing.assert_array_equal(column, getattr(there, name))


def test_a_worker_killed_midway_loses_no_frame(address, painter, frames, tmp_path):
    painter = work.Painter(painter.strokes, painter.texture, kills=4, marker=tmp_path / "killed")
    assert list(parallel_map(painter, range(NUM_FRAMES), scheduler=address)) == frames
    assert painter.marker.exists()


def test_an_item_that_always_kills_its_worker_is_named(address, monkeypatch):
    monkeypatch.setattr(cluster, "MAX_ATTEMPTS", 1)  # Dask itself retries before it gives up
    with pytest.raises(ChildProcessError, match=r"item 0 was lost \d times together with its worker"):
        list(parallel_map(work.die, [None], scheduler=address))


def test_an_error_of_the_work_arrives_as_it_is_and_in_its_turn(address):
    results = parallel_map(work.fail_at_3, range(9), scheduler=address)
    assert [next(results) for _ in range(3)] == [0, 1, 2]
    with pytest.raises(bg.SceneError, match=r"^a\.ply: is bad"):
        next(results)


def test_items_are_not_read_as_tasks_or_keys_of_dask_and_one_takes_one_thread(address):
    items = [(len, "abc"), {"a": (work.square, 2)}, ["x"], None]
    assert list(parallel_map(work.identity, items, scheduler=address)) == items
    assert set(parallel_map(work.num_threads, range(4), scheduler=address)) == {1}


def test_ctrl_c_leaves_the_cluster_alive_and_empty(address, tmp_path):
    code = (
        "import itertools\n"
        "from brushgs.pipeline.parallel import parallel_map\n"
        "from tests.parallel.work import slow_process_id\n"
        f"for pid in parallel_map(slow_process_id, itertools.count(), scheduler={address!r}):\n"
        "    print(pid, flush=True)\n"
    )
    script = run_script(tmp_path / "endless.py", code)
    workers = {int(script.stdout.readline()) for _ in range(10)}
    script.send_signal(signal.SIGINT)
    _, err = script.communicate(timeout=60)
    assert err.count("Traceback") == 1, err
    assert err.endswith("KeyboardInterrupt\n")
    assert set(parallel_map(work.slow_process_id, range(10), scheduler=address)) == workers


def pretend(version):
    """brushgs has another version, or None: is not there; what was is put back by its own."""
    import sys

    kept = sys.modules.setdefault("kept", sys.modules["brushgs"])
    sys.modules["brushgs"] = None if version is None else kept
    kept.__version__ = version or kept.__version__


@for_each("where", ["worker", "scheduler"])
def test_another_version_of_brushgs_is_refused(address, watch, where):
    [*workers] = watch.nthreads()
    named = f"worker {workers[1]}" if where == "worker" else where

    def on(function, *words):
        if where == "worker":
            watch.run(function, *words, workers=workers[1:])
        else:
            watch.run_on_scheduler(function, *words)

    for version, got in (("0.0.9", " .*, got 0.0.9"), (None, ", got none")):
        on(pretend, version)
        try:
            with pytest.raises(ValueError, match=f"the {named} must have brushgs {__version__}{got}"):
                list(parallel_map(work.square, [1], scheduler=address))
        finally:
            on(pretend, __version__)


def test_python_and_dask_must_be_alike_but_for_the_last_number():
    here = {"python": "3.11.7.final.0", "distributed": "2026.8.0"}
    connection.check_packages("scheduler", here, {"python": "3.11.9.final.0", "distributed": "2026.8.1"})
    for other in ({"python": "3.12.1.final.0"}, {"distributed": "2026.3.0"}):
        (name,) = other
        with pytest.raises(ValueError, match=rf"the scheduler must have {name} .* got (3\.12|2026\.3)"):
            connection.check_packages("scheduler", here, here | other)


def test_losing_all_workers_and_then_the_scheduler_is_reported(clusters, monkeypatch):
    folder, running = clusters
    address = address_in(folder / "frail.json")
    monkeypatch.setattr(cluster, "CHECK_INTERVAL", 0.1)
    told = []
    waiting = connection.Waiting(0.2, told.append)
    results = parallel_map(work.slow_process_id, range(100), scheduler=address, waiting=waiting)
    next(results)
    assert told == []
    os.killpg(running["worker-frail"].pid, signal.SIGKILL)
    sentence = f"{address}: the Dask scheduler has had no workers for .*: dask worker {address}"
    with pytest.raises(ConnectionError, match=sentence):
        list(results)
    cure = f"start some: dask worker {address}"
    assert told == [f"{address}: the Dask scheduler has no workers; waiting 0.2 s for one ({cure})"]
    monkeypatch.setattr(connection, "CONNECT_TIMEOUT", 1)  # it may be gone before the connection is made
    timer = threading.Timer(0.3, os.killpg, (running["scheduler-frail"].pid, signal.SIGKILL))
    timer.start()
    sentence = f"{address}: (the connection to the|no) Dask scheduler (was lost|answers)"
    with pytest.raises(ConnectionError, match=sentence):
        list(parallel_map(work.square, [1], scheduler=address))
    timer.join()


def test_jobs_of_a_batch_run_on_a_cluster(address, tmp_path, capsys):
    bg.save(still_life_of(1000), tmp_path / "a.ply")
    text = '[[job]]\nscene = "a.ply"\nsize = "32x24"\nstroke = "gaussian"\nclean = "off"\n'
    text += 'output = "{number}.png"\n'
    (tmp_path / "jobs.toml").write_text(text + text.replace("png", "gif"))
    assert cli.main(["batch", str(tmp_path / "jobs.toml"), "--scheduler", address, "--json"]) == 2
    first, second = json.loads(capsys.readouterr().out)["jobs"]
    assert (first["state"], second["state"]) == ("done", "failed")
    assert "2.gif is a video" in second["error"]
    assert (tmp_path / "1.png").exists()


@pytest.fixture(scope="module")
def lonely(tmp_path_factory):
    """Address of a scheduler without workers."""
    folder = tmp_path_factory.mktemp("lonely")
    process = start(folder, "scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", "a.json")
    yield address_in(folder / "a.json")
    stop(process)


@for_each("words", [[], ["--quiet"], ["--json"]])
def test_a_scheduler_without_workers_is_told_and_refused(lonely, tmp_path, monkeypatch, capsys, words):
    monkeypatch.chdir(tmp_path)
    bg.save(still_life_of(2000), "scene.ply")
    monkeypatch.setattr("brushgs.pipeline.sequence.prepare", None)  # not reached: workers are awaited first
    words = [*words, "--orbit", "5", "--scheduler", lonely, "--workers-timeout", "0.3"]
    code = cli.main(["render", "scene.ply", *words])
    captured = capsys.readouterr()
    assert (code, captured.out) == (2, "")
    lines = captured.err.splitlines()
    cure = f"start some: dask worker {lonely}"
    note = f"brushgs: note: {lonely}: the Dask scheduler has no workers; waiting 0.3 s for one ({cure})"
    end = f"brushgs: {lonely}: the Dask scheduler has had no workers for 0.3 s; {cure}"
    assert lines == ([note, end] if words[0] == "--orbit" else [end])
    assert [path.name for path in tmp_path.iterdir()] == ["scene.ply"]


def test_an_address_without_a_scheduler_gets_one_sentence(monkeypatch):
    monkeypatch.setattr(connection, "CONNECT_TIMEOUT", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1]
        address = f"tcp://127.0.0.1:{port}"
        with pytest.raises(ConnectionError, match=f"{address}: no Dask scheduler answers .*timed"):
            next(parallel_map(work.square, [1], scheduler=address))
    with pytest.raises(ConnectionError, match=f"{address}: .* answers .Connection refused"):
        next(parallel_map(work.square, [1], scheduler=address))


def test_without_dask_the_cure_is_named_and_without_items_it_is_not_asked(monkeypatch):
    assert list(parallel_map(work.square, [], scheduler="tcp://127.0.0.1:1")) == []
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ValueError, match=r"pip install 'dask\[distributed\]'"):
        next(parallel_map(work.square, [1], scheduler="tcp://127.0.0.1:8786"))
