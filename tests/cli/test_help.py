"""Every verb can be found: in the help, in its own help, and in the documentation."""

from pathlib import Path

import pytest

import tactful.cli
from docs._generate_cli import COMMAND, PAGE, render
from tactful.cli._app import VERBS, app, main


def test_every_file_is_a_verb() -> None:
    """Verbs are found by their files; a verb that the search misses is a verb nobody can call."""
    files = {path.stem for path in Path(tactful.cli.__path__[0]).glob("[!_]*.py")}
    assert set(VERBS) == files


@pytest.mark.parametrize("verb", VERBS)
def test_verb_has_help(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    """`tactful VERB --help` says what the verb does and what each of its parameters is for."""
    assert app[verb].help
    arguments = app[verb].assemble_argument_collection(parse_docstring=True)
    assert not [argument.name for argument in arguments if not argument.parameter.help]
    assert main([verb, "--help"]) == 0
    assert f"Usage: tactful {verb}" in capsys.readouterr().out


def test_help_lists_every_verb(capsys: pytest.CaptureFixture[str]) -> None:
    """`tactful --help` is where a newcomer begins: every verb with what it does."""
    assert main(["--help"]) == 0
    shown = capsys.readouterr().out
    for verb in VERBS:
        assert f" {verb} " in shown
        assert app[verb].help.split()[0] in shown


def test_documentation_is_up_to_date() -> None:
    """The reference is generated, so that it cannot promise what the command line does not do."""
    assert PAGE.read_text(encoding="utf-8") == render(), f"docs/cli.md is out of date; run: {COMMAND}"
