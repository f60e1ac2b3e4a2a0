"""What every command of `fjr` does when something goes wrong: one sentence and an exit status."""

from __future__ import annotations

import errno
import functools
import os
import resource
import signal
import tempfile
import threading
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager
from typing import Any, NoReturn, TypeVar

import typer

from fjr_kit.errors import InputError

Command = TypeVar("Command", bound=Callable[..., Any])

BAD_INPUT, FAILURE, INTERRUPTED = 2, 1, 130

_LONGEST = 200
"""Characters of an unexpected error that its sentence shows."""
_WITHOUT_MEMORY = ("can't start new thread", "failed to map segment from shared object")
"""What the interpreter and the loader of libraries say then, without a type of error of its own."""
_LEAST_BYTES = 512 * 2**20
"""Least limit of a process' memory. Below, OpenBLAS may wait for ever for memory as it is loaded
(seen at 450 MB on two cores; 550 MB are enough there for `fjr simulate`)."""


def reports_errors(kept: str) -> Callable[[Command], Command]:
    """Decorate a command so that no traceback reaches the user.

    Bad input exits with 2, Ctrl-C, SIGTERM and a terminal that is closed with 130, an error of ours
    with 1; its traceback goes to a file, or to the terminal if FJR_DEBUG=1.

    Args:
        kept: what Ctrl-C leaves behind, as in 'nothing was written'.
    """

    def decorate(command: Command) -> Command:
        @functools.wraps(command)
        def reporting(*args: Any, **options: Any) -> Any:
            _refuse_little_memory()
            try:
                with _ended_as_by_ctrl_c():
                    return command(*args, **options)
            except typer.Exit:
                raise
            except InputError as error:
                leave(str(error), BAD_INPUT)
            except KeyboardInterrupt:
                leave(f"Interrupted: {kept}.", INTERRUPTED)
            except Exception as error:
                if os.environ.get("FJR_DEBUG") == "1":
                    raise
                if _interrupted(error):
                    leave(f"Interrupted: {kept}.", INTERRUPTED)
                leave(_out_of_memory(error) or _report(error), FAILURE)

        return reporting  # type: ignore[return-value]

    return decorate


def _refuse_little_memory() -> None:
    """End the command if its shell allows a process too little memory."""
    allowed, _ = resource.getrlimit(resource.RLIMIT_AS)
    if 0 <= allowed < _LEAST_BYTES:
        leave(
            f"A process may take {allowed // 2**20} MiB of memory here (ulimit -v), and fjr needs "
            f"{_LEAST_BYTES // 2**20} MiB or more; raise that limit.",
            FAILURE,
        )


@contextmanager
def _ended_as_by_ctrl_c() -> Iterator[None]:
    """Let SIGTERM and SIGHUP raise KeyboardInterrupt, so that what is half made is cleared away.

    What ignores a signal, as nohup does SIGHUP, goes on ignoring it.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    taken = [n for n in (signal.SIGTERM, signal.SIGHUP) if signal.getsignal(n) == signal.SIG_DFL]
    for number in taken:
        signal.signal(number, signal.default_int_handler)
    try:
        yield
    finally:
        for number in taken:
            signal.signal(number, signal.SIG_DFL)


def leave(sentence: str, status: int) -> NoReturn:
    """End the command with a sentence on stderr and an exit status."""
    typer.echo(sentence, err=True)
    raise typer.Exit(status) from None


def _interrupted(error: Exception) -> bool:
    """Tell whether an error is Ctrl-C, met by a library that was taking its locks just then.

    The standard library's `with` on locks of several futures releases what it has not taken yet.
    """
    locks = isinstance(error, RuntimeError)
    return locks and any(isinstance(each, KeyboardInterrupt) for each in _causes(error))


def _out_of_memory(error: BaseException) -> str | None:
    """Return the sentence for an error that low memory has caused, else None.

    Whatever was under way, such as a compilation, wraps the error in its own words.
    """
    for cause in _causes(error):
        low = isinstance(cause, OSError) and cause.errno == errno.ENOMEM
        low = low or any(words in str(cause) for words in _WITHOUT_MEMORY)
        if low or isinstance(cause, (MemoryError, BrokenExecutor)):
            return (
                "The memory is not enough, or a process of fjr was killed for it; free some, or "
                "give fewer --workers, realizations or samples."
            )
    return None


def _causes(error: BaseException) -> Iterator[BaseException]:
    """Yield an error and, one after the other, what it was raised from or while handling."""
    cause: BaseException | None = error
    while cause is not None:
        yield cause
        cause = cause.__cause__ or cause.__context__


def _report(error: Exception) -> str:
    """Write the traceback to a file; return the sentence that says where."""
    handle, path = tempfile.mkstemp(prefix="fjr-", suffix=".log", text=True)
    with os.fdopen(handle, "w", encoding="utf-8") as log:
        traceback.print_exception(error, file=log)
    text = " ".join(str(error).split())[:_LONGEST]
    what = f"{type(error).__name__}: {text}".rstrip(": ")
    return f"fjr failed unexpectedly ({what}); the traceback is in {path}."
