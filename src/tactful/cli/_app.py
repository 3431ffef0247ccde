"""The app that finds the verbs, and what becomes of their errors."""

import os
import pkgutil
import sys
from collections.abc import Sequence

from cyclopts import App, CycloptsError, Parameter

import tactful.cli
from tactful import __version__
from tactful.errors import TactfulError

EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130  # 128 + SIGINT, as a shell reports it
EXIT_BROKEN_PIPE = 141  # 128 + SIGPIPE

VERBS = tuple(module.name for module in pkgutil.iter_modules(tactful.cli.__path__) if not module.name.startswith("_"))

app = App(
    name="tactful",
    help="Tell from its joint sensors that a robot arm is touched: since when, how hard, and what the touch is.",
    version=__version__,
    default_parameter=Parameter(negative=()),
    suppress_keyboard_interrupt=False,
    result_action="return_int_as_exit_code_else_zero",
)
for verb in VERBS:
    app.command(f"tactful.cli.{verb}:{verb}", name=verb)
app.register_install_completion_command(help="Install completion of verbs and options for this shell.")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Bad input of any kind ends in one line on stderr and 2. Whatever else goes wrong is a bug and keeps its traceback.

    Args:
        arguments: The words after `tactful`; those of the process by default.

    Returns:
        What the verb returned (0 by default, 1 if it ran degraded), 2 for bad input, 130 when interrupted.
    """
    words = sys.argv[1:] if arguments is None else list(arguments)
    try:
        if not words or words[0] in app.help_flags:
            app.resolved_commands()  # the list of verbs shows the first line of each one's help
        code: int = app(words, exit_on_error=False, print_error=False)
        sys.stdout.flush()
        return code
    except TactfulError as error:
        return _refuse(str(error))
    except CycloptsError as error:
        chain = " ".join(["tactful", *(error.command_chain or ())])
        return _refuse(f"{error} See: {chain} --help")
    except BrokenPipeError:  # the reader, such as `head`, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_BROKEN_PIPE
    except OSError as error:
        return _refuse(f"{error.filename}: {error.strerror}" if error.filename else str(error))
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED


def _refuse(message: str) -> int:
    print("tactful:", " ".join(message.split()), file=sys.stderr)
    return EXIT_BAD_INPUT
