"""How the command line ends: exit codes, and one line for whatever a user can cause."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator

import pytest

import tactful
from tactful.cli._app import app, main
from tactful.errors import TactfulError

Register = Callable[[Callable[[], int | None]], None]


@pytest.fixture
def verb() -> Iterator[Register]:
    """Register a function as the verb `probe` for one test."""
    yield lambda function: app.command(function, name="probe")
    del app["probe"]


@pytest.mark.parametrize(("returned", "code"), [(None, 0), (0, 0), (1, 1)])
def test_exit_code_is_what_the_verb_returns(verb: Register, returned: int | None, code: int) -> None:
    """Scripts tell a degraded run (1) from a clean one (0) by the exit code."""

    def probe() -> int | None:
        return returned

    verb(probe)
    assert main(["probe"]) == code


def test_bad_input_is_one_line(verb: Register, capsys: pytest.CaptureFixture[str]) -> None:
    """Bad input is the user's to mend: the message, no traceback, nothing on stdout, exit 2."""

    def probe() -> None:
        raise TactfulError("log.csv: no column for q_3;\n  add it or name a mapping")

    verb(probe)
    assert main(["probe"]) == 2
    assert capsys.readouterr() == ("", "tactful: log.csv: no column for q_3; add it or name a mapping\n")


def test_file_system_error_is_one_line(verb: Register, capsys: pytest.CaptureFixture[str]) -> None:
    """A folder that is not there, a full disk and a missing right are no bugs of Tactful."""

    def probe() -> None:
        open("/nowhere/p.png", "w")  # noqa: SIM115

    verb(probe)
    assert main(["probe"]) == 2
    assert capsys.readouterr().err == "tactful: /nowhere/p.png: No such file or directory\n"


def test_bug_keeps_its_traceback(verb: Register) -> None:
    """A bug that is reported without its traceback cannot be mended."""

    def probe() -> None:
        raise ZeroDivisionError

    verb(probe)
    with pytest.raises(ZeroDivisionError):
        main(["probe"])


def test_interrupt_ends_quietly(verb: Register, capsys: pytest.CaptureFixture[str]) -> None:
    """Ctrl-C is how a long run is ended: 130 as shells expect, and no traceback."""

    def probe() -> None:
        raise KeyboardInterrupt

    verb(probe)
    assert main(["probe"]) == 130
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["prob"], 'Unknown command "prob". Did you mean "probe"? Available commands:'),
        (["probe", "--sped", "1"], "Unknown option: --sped. Did you mean --speed? See: tactful probe --help"),
        (["probe", "--speed", "fast"], 'Invalid value for --speed: unable to convert "fast" into float. See:'),
    ],
)
def test_usage_error_is_one_line_with_a_hint(
    verb: Register, capsys: pytest.CaptureFixture[str], arguments: list[str], line: str
) -> None:
    """A slip of the keyboard is answered by the nearest name and the way to the help."""

    def probe(*, speed: float = 1.0) -> None: ...

    verb(probe)
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"tactful: {line}")
    assert err.count("\n") == 1


def test_version() -> None:
    """`python -m tactful` is the command line too, and states the one version."""
    run = subprocess.run([sys.executable, "-m", "tactful", "--version"], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == tactful.__version__


@pytest.mark.parametrize("argument", ["--version", "--help"])
def test_closed_pipe_ends_quietly(argument: str) -> None:
    """`tactful monitor --json | head` closes the pipe early; that is no error to tell about."""
    reader, writer = os.pipe()
    os.close(reader)
    run = subprocess.run(
        [sys.executable, "-m", "tactful", argument], stdout=writer, stderr=subprocess.PIPE, text=True, check=False
    )
    os.close(writer)
    assert run.stderr == ""
    assert run.returncode != 0
