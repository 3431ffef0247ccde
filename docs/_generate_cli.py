"""Write docs/cli.md: what the command line says of itself."""

import io
from pathlib import Path

from rich.console import Console

from tactful.cli._app import VERBS, app

COMMAND = ".venv/bin/python docs/_generate_cli.py"
PAGE = Path(__file__).with_name("cli.md")

HEAD = f"""\
# Command line

Exit codes: 0 after a clean run; 1 after a run that reached its end but degraded, because samples were missing or
unusable; 2 for bad input, told in one line on stderr. `tactful --install-completion` teaches the shell to complete
verbs and options.

This page shows the help of every command and is written by `{COMMAND}`.
"""


def render() -> str:
    """Return the page."""
    app.resolved_commands()
    commands = [[], *(command for verb in VERBS for command in _with_parts([verb]))]
    return "\n".join([HEAD, *(_section(words) for words in commands)])


def _with_parts(words: list[str]) -> list[list[str]]:
    """Return a command and those below it."""
    _, apps, _ = app.parse_commands(words)
    parts = [name for name in apps[-1] if not name.startswith("-")]
    return [words, *(deeper for part in parts for deeper in _with_parts([*words, part]))]


def _section(words: list[str]) -> str:
    console = Console(file=io.StringIO(), width=100, color_system=None, force_terminal=False)
    app.help_print(words, console=console)
    text = "\n".join(line.rstrip() for line in console.file.getvalue().splitlines())
    return f"## {' '.join(['tactful', *words])}\n\n```text\n{text}\n```\n"


if __name__ == "__main__":
    PAGE.write_text(render(), encoding="utf-8")
