"""A file of jobs is written out as command lines, and what is wrong in it is told with its line."""

from pathlib import Path

import pytest

from brushgs.cli.batch.check import check_jobs
from brushgs.cli.batch.jobs import read_jobs
from tests.kit.for_each import for_each


@pytest.fixture(autouse=True)
def scenes(folder):
    for name in ("a.ply", "b.spz"):
        (folder / name).touch()


def jobs_of(text):
    Path("jobs.toml").write_text(text, encoding="utf-8")
    return read_jobs(Path("jobs.toml"))


def refused(text):
    with pytest.raises(ValueError) as caught:
        check_jobs(jobs_of(text))
    return str(caught.value)


def job(*lines):
    return "\n".join(["[[job]]", 'scene = "a.ply"', 'output = "a.png"', *lines])


def test_lists_are_written_out_in_order_and_name_their_outputs():
    text = """
    [defaults]
    azimuth = 30
    [[job]]
    output = "out/{number}-{scene}-{look}-{side}-{size}-{fov_deg}.png"
    fov_deg = 40.5
    [job.each]
    scene = ["a.ply", "b.spz"]
    look = ["oil", "looks/my own.toml"]
    size = [[64, 48]]
    side = [{ name = "front", from = "front" }, { elevation = 60 }]
    """
    jobs = jobs_of(text)
    names = [f"{a}-{b}-{c}" for a in "ab" for b in ("oil", "my_own") for c in ("front", "2")]
    outputs = [f"out/{number}-{name}-64x48-40.5.png" for number, name in enumerate(names, start=1)]
    assert [job.output for job in jobs] == outputs
    assert "--azimuth=30" not in jobs[0].words
    assert "--from=front" in jobs[0].words
    assert {"--azimuth=30", "--elevation=60"} <= set(jobs[1].words)
    assert "--look=looks/my own.toml" in jobs[2].words


def test_options_of_a_job_win_over_defaults_and_those_of_lists_over_both():
    text = '[defaults]\nstrokes = 5\nseed = 1\n[[job]]\nscene = "a.ply"\noutput = "{seed}.png"\nseed = 2\n'
    text += "stroke_size = 9\n[job.each]\nseed = [3, 4]"
    first, second = jobs_of(text)
    assert set(first.words) == {"a.ply", "--output=3.png", "--seed=3", "--stroke-size=9"}
    assert second.output == "4.png"


@for_each(
    ("text", "message"),
    [
        ("", "jobs.toml: must have at least one table"),
        ("[[jobs]]\nscene = 'a.ply'", "line 1: jobs is no table of a file of jobs; did you mean 'job'?"),
        ("defaults = 3\n[[job]]", "line 1: defaults must be a table"),
        ("[defaults]\n\nstrokez = 3\n[[job]]", "line 3: [defaults] strokez is no option; did you mean"),
        (job("quiet = true"), "line 4: job 1: quiet belongs to `brushgs batch`, for all jobs; remove it"),
        (job("command = 'rendr'"), "line 4: job 1: command must be one of render, export"),
        ("[[job]]\nscene = 'a.ply'", "job 1: output is missing; name what the job writes"),
        (job("[job.each]\nlook = 'oil'"), "line 4: job 1: each must hold lists"),
        ("[[job]]\nscene='a.ply'\noutput='{lok}.png'\nlook='ink'", "line 3: job 1: output has {lok}"),
        ("[[job]]\nscene='a.ply'\noutput='{.png'", "job 1: output '{.png'"),
        (job("keep = 30"), "line 1: job 1: keep must be above 0 and at most 1, got 30; for 30 % write 0.3"),
        ("[[job]]\noutput='a.png'", "job 1: scene is missing; name it"),
        ("[[job]]\nscene='c.ply'\noutput='a.png'", "c.ply: there is no such scene; names are"),
        ("[[job]]\ncommand='prune'\nscene='b.spz'\noutput='a.ply'\n" + job(), "a.ply, which job 2 reads"),
        (job() + "\n" + job(), "line 4: job 2: writes a.png, as job 1 does"),
        (job("azim = 30"), "azim is no option of `brushgs render`; did you mean 'azimuth'?"),
        ("[[job]\n", "jobs.toml: is not TOML"),
    ],
)
def test_what_is_wrong_in_a_file_of_jobs_is_told(text, message):
    assert message in refused(text)


def test_too_many_jobs_are_a_typing_error(monkeypatch):
    monkeypatch.setattr("brushgs.cli.batch.jobs.MAX_JOBS", 3)
    assert "has more than 3 jobs" in refused(job("[job.each]\nseed = [1, 2, 3, 4]"))
