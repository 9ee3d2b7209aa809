"""`brushgs batch`: four pictures in two processes, what fails, what is skipped, and what is printed."""

import contextlib
import io
import json
import os
import re
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from brushgs.cli import main
from brushgs.cli.batch.jobs import read_jobs
from brushgs.cli.batch.run import Outcome, Task, run_jobs
from brushgs.options.sequence import SequenceConfig
from tests.kit.commands import is_alive, names, refused, run
from tests.kit.for_each import for_each
from tests.kit.programs import ROOT, start
from tests.scenes import save_upright, still_life_of

JOBS = """
[defaults]
size = "48x36"
strokes = 60
clean = "off"
see = "off"
backdrop = "off"

[[job]]
scene = "pears.ply"
output = "out/{look}-{side}.png"
[job.each]
look = ["oil", "plain"]
side = [{ name = "left", from = "left" }, { name = "above", elevation = 60 }]
"""
NAMES = [f"{look}-{side}.png" for look in ("oil", "plain") for side in ("left", "above")]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder in which four jobs have run in two processes, and their JSON."""
    folder = tmp_path_factory.mktemp("batch")
    save_upright(still_life_of(1000), folder / "pears.ply")
    (folder / "jobs.toml").write_text(JOBS)
    with contextlib.redirect_stdout(io.StringIO()) as out:
        assert main(["batch", str(folder / "jobs.toml"), "--jobs", "2", "--json"]) == 0
    return folder, json.loads(out.getvalue())


def test_four_jobs_write_four_pictures_and_one_report(made):
    folder, report = made
    assert names(folder / "out") == sorted(NAMES)
    assert (report["done"], report["failed"], report["skipped"]) == (4, 0, 0)
    assert [line["output"] for line in report["jobs"]] == [str(folder / "out" / name) for name in NAMES]
    assert all(line["seconds"] > 0 and line["peak_memory_bytes"] > 1e6 for line in report["jobs"])
    assert names(folder) == [".jobs.toml.json", "jobs.toml", "out", "pears.ply"]


def test_a_batch_that_is_resumed_runs_what_is_missing_or_differs(made, capsys):
    folder, _ = made
    kept = {path: path.stat().st_mtime_ns for path in (folder / "out").iterdir()}
    (folder / "out" / "oil-left.png").unlink()
    (folder / "out" / "plain-left.png").write_bytes(b"another")
    dry = run(capsys, "batch", folder / "jobs.toml", "--resume", "--dry-run")[1]
    assert re.findall(r"--output=(\S+)", dry) == ["out/oil-left.png", "out/plain-left.png"]
    (folder / "jobs.toml").write_text(JOBS.replace('"plain"', '"plain", "ink"'))
    code, out, _ = run(capsys, "batch", folder / "jobs.toml", "--resume", "--json")
    report = json.loads(out)
    assert (code, report["done"], report["skipped"]) == (0, 4, 2)
    for path, changed in kept.items():
        assert (path.stat().st_mtime_ns == changed) == (path.name not in ("oil-left.png", "plain-left.png"))
    os.utime(folder / "pears.ply", (1, 1))
    assert len(run(capsys, "batch", folder / "jobs.toml", "--resume", "--dry-run")[1].splitlines()) == 6


def test_a_job_that_fails_does_not_stop_the_others(made, tmp_path, capsys):
    pears = made[0] / "pears.ply"
    text = f'[defaults]\nscene = "{pears}"\nsize = "32x24"\nlook = "plain"\n'
    text += '[[job]]\noutput = "a.gif"\n[[job]]\noutput = "b.png"\nstrokes = 20'
    (tmp_path / "two.toml").write_text(text)
    code, out, err = run(capsys, "batch", tmp_path / "two.toml")
    assert (code, out) == (2, "")
    for words in ("note: job 1 failed: a.gif is a video", "failed", "1 done, 1 failed, 0 skipped"):
        assert words in " ".join(err.split())
    assert (tmp_path / "b.png").exists()
    code, out, err = run(capsys, "batch", tmp_path / "two.toml", "--resume", "--json", "--jobs", "2")
    lines = json.loads(out)["jobs"]
    assert ([line["state"] for line in lines], err) == (["failed", "skipped"], "")
    assert "is a video and needs a camera path" in lines[0]["error"]
    err = refused(capsys, "batch", tmp_path / "two.toml", "--resume", "--quiet")
    assert err.startswith("brushgs: job 1: a.gif is a video")


def test_a_bad_job_is_told_before_any_runs(made, tmp_path, capsys):
    text = f'[[job]]\nscene = "{made[0]}/pears.ply"\noutput = "a.png"\n'
    (tmp_path / "one.toml").write_text(text + text)
    err = refused(capsys, "batch", tmp_path / "one.toml")
    assert "one.toml: line 4: job 2: writes a.png, as job 1 does" in err
    assert names(tmp_path) == ["one.toml"]


@for_each("content", ["[1]", "", "{}"])
def test_a_record_that_is_none_is_told(made, tmp_path, capsys, content):
    (tmp_path / "one.toml").write_text(f'[[job]]\nscene = "{made[0]}/pears.ply"\noutput = "a.png"\n')
    (tmp_path / ".one.toml.json").write_text(content)
    err = refused(capsys, "batch", tmp_path / "one.toml", "--resume")
    assert ".one.toml.json: is no record of a batch; remove it, and all jobs run again" in err


OUTPUTS = {  # of a job: what it is called with, and a file that it writes beside others
    "frames": (["render", "frames/%02d.png", "orbit = 3\nlook = 'plain'"], "frames/01.png"),
    "page": (["export", "a.html", ""], "a.html"),
    "strokes": (["cluster", "a.ply", ""], "a.ply"),
    "curves": (
        ["bench", "m", "strokes = [10, 20]\nquick = true\nfamilies = 'strokes'\nlook = 'plain'"],
        "m/bench.json",
    ),
}


@pytest.fixture(scope="module")
def every_kind(tmp_path_factory, made):
    """A folder in which a job of each kind of output has run."""
    folder = tmp_path_factory.mktemp("kinds")
    (folder / "pears.ply").write_bytes((made[0] / "pears.ply").read_bytes())
    text = '[defaults]\nscene = "pears.ply"\nsize = "32x24"\nstrokes = 20\nclean = "off"\nsee = "off"\n'
    for (command, output, more), _ in OUTPUTS.values():
        text += f'[[job]]\ncommand = "{command}"\noutput = "{output}"\n{more}\n'
    (folder / "jobs.toml").write_text(text)
    assert main(["batch", str(folder / "jobs.toml"), "--quiet"]) == 0
    return folder


def left(capsys, folder):
    return json.loads(run(capsys, "batch", folder / "jobs.toml", "--resume", "--dry-run", "--json")[1])


@for_each("kind", OUTPUTS)
def test_a_job_is_done_while_every_file_that_it_wrote_is_as_it_was(every_kind, capsys, kind):
    assert left(capsys, every_kind) == []
    (_, output, _), name = OUTPUTS[kind]
    path, content, state = every_kind / name, (every_kind / name).read_bytes(), (every_kind / name).stat()
    for change in (path.unlink, lambda: path.write_bytes(content[:-1]), lambda: os.utime(path, (1, 1))):
        change()
        [words] = left(capsys, every_kind)
        assert f"--output={output}" in words
        path.write_bytes(content)
        os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))
    assert left(capsys, every_kind) == []


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no signals to send")
def test_a_batch_that_is_stopped_leaves_whole_files_only(made, tmp_path):
    text = f'[defaults]\nscene = "{made[0]}/pears.ply"\nsize = "64x48"\nstrokes = 50\nlook = "plain"\n'
    text += 'see = "off"\nclean = "off"\n[[job]]\noutput = "first.png"\n' + "".join(
        f'[[job]]\norbit = 5000\noutput = "{name}.mp4"\n' for name in "ab"
    )
    (tmp_path / "jobs.toml").write_text(text)
    words = "batch", "jobs.toml", "--jobs", "2"
    process = start("-m", "brushgs", *words, cwd=tmp_path, start_new_session=True)
    until = time.monotonic() + 120
    while not (list(tmp_path.glob(".a-*")) and list(tmp_path.glob(".b-*"))):  # both films are being written
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < until
        time.sleep(0.05)
    process.send_signal(signal.SIGTERM)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 143
    assert "stopped: 2 of 3 jobs are not done; --resume runs them" in err
    assert names(tmp_path) == [".jobs.toml.json", "first.png", "jobs.toml"]


def test_jobs_of_one_scene_load_it_once_and_paint_what_each_paints_alone(made, tmp_path):
    folder, _ = made
    (tmp_path / "pears.ply").write_bytes((folder / "pears.ply").read_bytes())
    (tmp_path / "jobs.toml").write_text(JOBS)
    jobs = read_jobs(tmp_path / "jobs.toml")
    found = [outcome for _, outcome in run_jobs(jobs, SequenceConfig(), print)]
    stages = [{stage["name"] for stage in outcome.report["stages"]} for outcome in found]
    assert "load" in stages[0]
    assert all(one.isdisjoint({"load", "clean"}) for one in stages[1:])
    for name in NAMES:  # two at a time were made before
        assert (tmp_path / "out" / name).read_bytes() == (folder / "out" / name).read_bytes(), name
    words = [*jobs[-1].words, "--quiet"]
    alone = [word.replace(f"out/{NAMES[-1]}", "alone.png") for word in words]
    with contextlib.chdir(tmp_path):
        assert main(["render", *alone]) == 0
    assert (tmp_path / "alone.png").read_bytes() == (tmp_path / "out" / NAMES[-1]).read_bytes()


def die_or_tell(task):
    """Work in place of a job: it ends its process, or says which one this is."""
    if task.words in (("die",), ("exit",)):
        print("no room here", file=sys.stderr, flush=True)
        os.kill(os.getpid(), 9) if task.words == ("die",) else os._exit(3)
    return Outcome(0.5, "", {"by": os.getpid()})


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no signals to send")
def test_a_job_that_ends_its_process_leaves_the_others_to_another_one(monkeypatch, made):
    monkeypatch.syspath_prepend(ROOT)
    monkeypatch.setattr("brushgs.cli.batch.run.TaskRunner", lambda: die_or_tell)
    monkeypatch.setattr("brushgs.cli.batch.run._task_of", lambda job, *_, **__: Task((job.output,), "."))
    jobs = read_jobs(made[0] / "jobs.toml")[:1] * 5
    jobs = [replace(job, output=name) for job, name in zip(jobs, ("a", "die", "b", "exit", "c"), strict=True)]
    found = {job.output: outcome for job, outcome in run_jobs(jobs, SequenceConfig(), print)}
    assert [found[name].error for name in ("a", "b", "c")] == [""] * 3
    assert "was killed by signal 9; if it ran out of memory, use fewer --jobs" in found["die"].error
    assert found["exit"].error == "no room here"
    assert len({found[name].report["by"] for name in ("a", "b", "c")}) == 3


@pytest.mark.skipif(sys.platform != "linux", reason="asks /proc")
def test_jobs_end_with_the_batch_that_was_killed_and_leave_no_files(made, tmp_path):
    text = f'[[job]]\nscene = "{made[0]}/pears.ply"\nsize = "64x48"\nstrokes = 50\nlook = "plain"\n'
    (tmp_path / "jobs.toml").write_text(text + 'orbit = 5000\noutput = "a.mp4"\n')
    (tmp_path / "temporary").mkdir()
    how = {"cwd": tmp_path, "env": {"TMPDIR": str(tmp_path / "temporary")}, "stdout": None, "stderr": None}
    process = start("-m", "brushgs", "batch", "jobs.toml", "--quiet", **how)
    until = time.monotonic() + 120
    while not list(tmp_path.glob(".a-*")):
        assert process.poll() is None
        assert time.monotonic() < until
        time.sleep(0.05)
    children = Path(f"/proc/{process.pid}/task").glob("*/children")
    pids = [int(pid) for path in children for pid in path.read_text().split()]
    assert len(pids) == 1
    process.kill()
    process.wait()
    while any(map(is_alive, pids)) or list(tmp_path.glob(".a-*")) or list(tmp_path.glob("temporary/*")):
        assert time.monotonic() < until
        time.sleep(0.05)
