"""What every command of `fjr` does when something goes wrong: one sentence and an exit status."""

from __future__ import annotations

import functools
import os
import tempfile
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import typer

from fjr_interface.errors import InputError

Command = TypeVar("Command", bound=Callable[..., Any])

BAD_INPUT, FAILURE, INTERRUPTED = 2, 1, 130


def guarded(kept: str) -> Callable[[Command], Command]:
    """Decorate a command so that no traceback reaches the user.

    Bad input exits with 2, Ctrl-C with 130, an error of ours with 1; its traceback goes to a file,
    or to the terminal if FJR_DEBUG=1.

    Args:
        kept: what Ctrl-C leaves behind, as in 'nothing was written'.
    """

    def decorate(command: Command) -> Command:
        @functools.wraps(command)
        def guard(*args: Any, **options: Any) -> Any:
            try:
                return command(*args, **options)
            except typer.Exit:
                raise
            except InputError as error:
                _leave(str(error), BAD_INPUT)
            except KeyboardInterrupt:
                _leave(f"Interrupted: {kept}.", INTERRUPTED)
            except Exception as error:
                if os.environ.get("FJR_DEBUG") == "1":
                    raise
                _leave(_report(error), FAILURE)

        return guard  # type: ignore[return-value]

    return decorate


@contextmanager
def needing_ros(otherwise: str = "") -> Iterator[None]:
    """Turn an import that fails in the body into an InputError.

    Args:
        otherwise: what else the user may do, as in ', or use fjr simulate'.
    """
    try:
        yield
    except ImportError as error:
        raise InputError(
            f"ROS 2 is not there ({error}); install fjr-rig[ros] or source ROS 2 Jazzy{otherwise}."
        ) from None


def _leave(sentence: str, status: int) -> None:
    typer.echo(sentence, err=True)
    raise typer.Exit(status) from None


def _report(error: Exception) -> str:
    """Write the traceback to a file; return the sentence that says where."""
    handle, path = tempfile.mkstemp(prefix="fjr-", suffix=".log", text=True)
    with os.fdopen(handle, "w", encoding="utf-8") as log:
        traceback.print_exception(error, file=log)
    what = " ".join([f"{type(error).__name__}:", *str(error).split()])
    return f"fjr failed unexpectedly ({what.rstrip(':')}); the traceback is in {path}."
