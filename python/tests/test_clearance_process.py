"""The command `adaptive_bvh` as a process: its package, how it ends, what it writes."""

import os
import pathlib
import signal
import stat
import subprocess
import sys
import threading
import time

import pytest
from meshes import ball, sheet
from sequence_files import write_ply
from test_clearance import COMMAND, ENVIRONMENT, page, run  # noqa: F401

import adaptive_bvh as ab
from adaptive_bvh._clearance import _command, main

BUILD = pathlib.Path(ab.__file__).parents[2]


@pytest.fixture
def files(tmp_path):
    """A ball that comes as near as 1 to a sheet; the words that check this."""
    vertices, faces = ball(1)
    for k in range(3):
        write_ply(tmp_path / f"ball_{k}.ply", vertices + [k, 0, 2], faces)
    write_ply(tmp_path / "part.ply", *sheet(1, 9.0))
    return ["clearance", "--moving", str(tmp_path / "ball_*.ply"), "--parts",
            str(tmp_path / "part.ply")]


# ---- where the command finds its package ---------------------------------------------------------


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    if not (BUILD / "cmake_install.cmake").exists():
        pytest.skip("the package is not in a build of CMake's")
    prefix = tmp_path_factory.mktemp("prefix")
    subprocess.run(["cmake", "--install", BUILD, "--component", "python", "--prefix", prefix],
                   check=True, capture_output=True)
    return prefix / "bin" / "adaptive_bvh"


@pytest.mark.parametrize("how", ["path", "link"])
def test_the_installed_command_finds_its_package(tmp_path, files, installed, how):
    command = installed
    if how == "link":
        command = tmp_path / "command"
        command.symlink_to(installed)
    result = subprocess.run([command, *files], cwd="/", env={}, capture_output=True, text=True)
    assert (result.returncode, result.stderr) == (0, "")
    version = subprocess.run([command, "--version"], cwd="/", env={}, capture_output=True, text=True)
    assert version.stdout == f"adaptive_bvh {ab.__version__}\n"


def test_a_study_of_the_installed_command(tmp_path, files, installed):
    """Its processes import the file of the command."""
    pytest.importorskip("distributed", reason="distributed is not installed")
    (tmp_path / "study.csv").write_text("name,moving\nA,ball_*.ply\n")
    result = subprocess.run(
        [installed, "clearance", "--study", tmp_path / "study.csv", *files[3:]], cwd="/",
        env={name: ENVIRONMENT[name] for name in ("PATH", "PYTHONPATH")}, capture_output=True,
        text=True)
    assert (result.returncode, result.stdout) == (0, "A: KEPT: nothing touches.\n"), result.stderr


# ---- exit status ---------------------------------------------------------------------------------


def test_ctrl_c_at_any_time(tmp_path, files, installed):
    """While Python begins, while the package is imported, while the command runs."""
    for k in range(12):
        process = subprocess.Popen(
            [installed, *files], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
        begin = time.monotonic()
        while (pathlib.Path(f"/proc/{process.pid}/exe").resolve().name == "env"
               and time.monotonic() - begin < 5):
            time.sleep(0.001)  # what starts Python
        time.sleep(0.03 * k)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        assert process.returncode in (0, 3) and "Traceback" not in errors, (k, errors)
        assert process.returncode == 3 or k > 0


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_the_end_of_a_job_is_an_interruption(tmp_path, files, number):
    slow = tmp_path / "slow.py"
    slow.write_text(
        "import os, signal, time\n"
        "from adaptive_bvh import __main__\n"
        "def main():\n"
        f"    os.kill(os.getpid(), {int(number)})\n"
        "    time.sleep(60)\n"
        "__main__.main = main\n"
        "__main__.run()\n")
    result = subprocess.run([sys.executable, "-B", slow], env=ENVIRONMENT, capture_output=True,
                            text=True, timeout=50)
    assert result.returncode == 3 and "Traceback" not in result.stderr


@pytest.mark.parametrize("error", [KeyError("x"), MemoryError(), RecursionError("deep"),
                                   GeneratorExit()])
def test_an_error_that_nothing_foresaw(monkeypatch, capsys, files, error):
    def fail(*_):
        raise error
    monkeypatch.setattr(_command, "run", fail)
    assert main(files) == 4
    said, = capsys.readouterr().err.splitlines()
    assert said.startswith(f"internal error: {type(error).__name__}") and "send this line" in said


@pytest.mark.parametrize("close", ["out", "error", "both"])
@pytest.mark.parametrize("words", [[], ["--help"], ["--wrong"]])
def test_nobody_reads(files, close, words):
    reader, writer = os.pipe()
    os.close(reader)
    streams = {"stdout": writer if close != "error" else subprocess.DEVNULL,
               "stderr": writer if close != "out" else subprocess.PIPE}
    process = subprocess.Popen([*COMMAND[:-1], *files, *words], env=ENVIRONMENT, **streams)
    os.close(writer)
    errors = process.communicate(timeout=60)[1]
    assert process.returncode == (2 if words == ["--wrong"] else 0)
    assert b"Traceback" not in (errors or b"") and b"Exception" not in (errors or b"")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
def test_a_full_disk_for_the_answer(files):
    with open("/dev/full", "w") as full:
        result = subprocess.run([*COMMAND[:-1], *files], env=ENVIRONMENT, stdout=full,
                                stderr=subprocess.PIPE, text=True)
    assert result.returncode == 2 and result.stderr.count("\n") == 1, result.stderr


def test_lengths_that_are_negative(run, files, capsys):  # noqa: F811
    for words in (["--clearance", "-5mm"], ["--clearance", "-.5", "mm"], ["--tolerance", "-5e-3"]):
        assert main([*files, *words]) == 2
        assert "is no length; write a number that is not negative" in capsys.readouterr().err


# ---- files ---------------------------------------------------------------------------------------


def test_links_stay_links(run, tmp_path, files, page):  # noqa: F811
    for name in ("table.csv", "page.html"):
        (tmp_path / f"to_{name}").symlink_to(name)
    for _ in range(2):
        assert main([*files, "--csv", str(tmp_path / "to_table.csv"), "--report",
                     str(tmp_path / "to_page.html")]) == 0
        assert (tmp_path / "to_table.csv").is_symlink() and (tmp_path / "to_page.html").is_symlink()
        assert (tmp_path / "table.csv").read_text().startswith("moving,part")
        assert (tmp_path / "page.html").read_text().startswith("<!DOCTYPE html>")


def test_devices_and_pipes_are_written_into(tmp_path, files, page):  # noqa: F811
    pipe, got = tmp_path / "pipe", []
    os.mkfifo(pipe)
    for option in ("--csv", "--report"):
        reader = threading.Thread(target=lambda: got.append(pipe.read_text()))
        reader.start()
        assert main([*files, option, str(pipe)]) == 0
        reader.join(20)
        assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert got[0].startswith("moving,part") and got[1].startswith("<!DOCTYPE html>")
    assert main([*files, "--csv", "/dev/null", "--report", "/dev/null"]) == 0
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)


def test_folders_and_full_disks_are_refused(tmp_path, files, capsys):
    (tmp_path / "folder").mkdir()
    (tmp_path / "link").symlink_to("folder")
    for name in (tmp_path / "folder", tmp_path / "link", "/dev/full"):
        assert main([*files, "--csv", str(name)]) == 2
        assert f"{name} cannot be written" in capsys.readouterr().err
    assert os.listdir(tmp_path / "folder") == []


def test_ctrl_c_while_nobody_reads_a_pipe(tmp_path, files):
    os.mkfifo(tmp_path / "pipe")
    process = subprocess.Popen(
        [*COMMAND[:-1], *files, "--csv", str(tmp_path / "pipe")], env=ENVIRONMENT,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
    assert process.stdout.readline().startswith("KEPT")
    time.sleep(0.5)  # it waits for a reader now
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 3 and "pipe is not written" in errors
