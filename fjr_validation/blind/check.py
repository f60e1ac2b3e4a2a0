"""Runs a blind check: cases made and sealed, verdicts committed, only then answers unsealed.

The protocol, and what it is worth: a process of its own makes the cases and gives out bags,
encrypted answers and the SHA-256 of each answer. The diagnosis processes are told the folder of one
case's bags and nothing else; key and seed are in neither their arguments, nor their environment,
nor the folder of the check, but in a file of the user's state folder. When every case has its
verdicts, the SHA-256 of each verdict is written down; then the answers are decrypted, compared with
what was committed to, and scored. After that no verdict is made or replaced. This guards against a
method that sees an answer by accident or by convenience, and lets others check that neither answers
nor verdicts were changed. It does not guard against a user who breaks his own seal: who knows the
seed can make the cases again, and who owns the state folder can read the key.
"""

from __future__ import annotations

import json
import secrets
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from fjr_kit.atomic import write_whole
from fjr_kit.errors import InputError
from fjr_kit.installed import product_version
from fjr_kit.result_types import Document
from fjr_kit.tasks import Task, computed

from .cases import Answer
from .files import case_folder, case_name, read_json, sealed_file, verdict_file, write_json
from .methods import METHODS, check_methods, verdict
from .seal import Secret, decrypt, digest

MOST_CASES = 1000

Report = Callable[[int, int, str], None]
"""Called with (done, all, what was done)."""


class Manifest(Document):
    """What `blind.json` holds: what a check is; see `BlindCheck`."""

    schema_name: Literal["fjr_rig/blind/1"] = Field("fjr_rig/blind/1", alias="schema")
    check: str
    cases: int
    methods: tuple[str, ...]
    version: str


@dataclass(frozen=True)
class BlindCheck:
    """A blind check in its folder.

    Attributes:
        folder: where it is.
        check: its identity.
        count: number of cases.
        methods: names of the methods compared.
        version: version of the product that began it.
    """

    folder: Path
    check: str
    count: int
    methods: tuple[str, ...]
    version: str

    @classmethod
    def begin(
        cls, folder: Path, count: int, seed: int | None, methods: Sequence[str] = tuple(METHODS)
    ) -> BlindCheck:
        """Begin a check, or take up the one in the folder.

        Raises:
            InputError: the folder holds another check, or one that was begun on another machine.
        """
        check_methods(list(methods))
        if not 1 <= count <= MOST_CASES:
            raise InputError(f"--cases must lie in [1, {MOST_CASES}], not {count}.")
        manifest = folder / "blind.json"
        if manifest.exists():
            return cls.open(folder)._as_ordered(count, seed, methods)
        if folder.exists() and any(folder.iterdir()):
            raise InputError(f"{folder} holds something else; choose another folder.")
        check = secrets.token_hex(8)
        Secret.draw(seed).save(check)
        begun = Manifest(
            check=check, cases=count, methods=tuple(methods), version=product_version()
        )
        folder.mkdir(parents=True, exist_ok=True)
        write_whole(manifest, begun.to_json())
        return cls.open(folder)

    @classmethod
    def open(cls, folder: Path) -> BlindCheck:
        """Open the check of a folder; raise InputError if there is none."""
        manifest = folder / "blind.json"
        if not manifest.exists():
            raise InputError(f"{folder} holds no blind check; begin one with `fjr blind run`.")
        begun = Manifest.read(manifest)
        return cls(folder, begun.check, begun.cases, begun.methods, begun.version)

    def _as_ordered(self, count: int, seed: int | None, methods: Sequence[str]) -> BlindCheck:
        """Return this check; raise InputError if what is ordered now is another one."""
        if count != self.count or set(methods) != set(self.methods):
            raise InputError(
                f"{self.folder} holds a check of {self.count} cases with the methods "
                f"{', '.join(self.methods)}; order the same, or choose another folder."
            )
        if seed is not None and not self.unsealed and Secret.load(self.check).seed != seed:
            raise InputError(f"{self.folder} holds a check of another seed; choose another folder.")
        return self

    @property
    def unsealed(self) -> bool:
        """Whether the answers have been unsealed."""
        return (self.folder / "answers.json").exists()

    def check_seals(self) -> None:
        """Open every seal that is there, and forget what it holds: what unsealing will rest on.

        Raises:
            InputError: the key cannot be read, or a seal is not what was committed to.
        """
        if self.unsealed:
            return
        secret = Secret.load(self.check)
        if (self.folder / "commitments.json").exists():
            committed = read_json(self.folder / "commitments.json")
            for index in range(self.count):
                self._as_committed(index, self._open(index, secret.key), committed)

    def make_cases(self, report: Report = lambda *_: None) -> None:
        """Make the cases that are missing, in a process of their own, and commit to the answers."""
        there = sum(case_folder(self.folder, index).exists() for index in range(self.count))
        if there < self.count:
            secret = Secret.load(self.check)
            order = {
                "folder": str(self.folder.absolute()),
                "cases": self.count,
                "seed": secret.seed,
                "key": secret.key.hex(),
            }
            _have_made(order, lambda name, made: report(there + made, self.count, f"{name} made"))
        if not (self.folder / "commitments.json").exists():
            self._commit_answers()

    def _commit_answers(self) -> None:
        key = Secret.load(self.check).key
        digests = {}
        for index in range(self.count):
            file = sealed_file(self.folder, index)
            digests[case_name(index)] = digest(decrypt(file.read_bytes(), key, str(file)))
        write_json(self.folder / "commitments.json", digests)

    def diagnose(
        self,
        scheduler: str | None = None,
        workers: int | None = None,
        report: Report = lambda *_: None,
    ) -> None:
        """Put every method to every case that lacks its verdict; failed ones are tried again."""
        tasks = [
            self._task(method, index)
            for method in self.methods
            for index in range(self.count)
            if not self._finished(method, index)
        ]
        total = self.count * len(self.methods)
        done = total - len(tasks)
        if tasks and self.unsealed:
            raise InputError(
                f"{self.folder} lacks verdicts, but its answers are unsealed; begin a new check."
            )
        for _, values in computed(tasks, workers=workers, scheduler=scheduler, apart=True):
            index = int(values["case"].removeprefix("case_"))
            write_json(verdict_file(self.folder, values["method"], index), values)
            done += 1
            said = values.get("error") or values["diagnosis"]["verdict"]
            report(done, total, f"{values['case']} by {values['method']}: {said}")

    def _task(self, method: str, index: int) -> Task:
        folder = case_folder(self.folder, index).absolute()
        return Task(f"{method}-{folder.name}", verdict, {"method": method, "folder": folder})

    def _finished(self, method: str, index: int) -> bool:
        file = verdict_file(self.folder, method, index)
        return file.exists() and (self.unsealed or "diagnosis" in read_json(file))

    def failures(self) -> list[str]:
        """Return what methods failed on, one sentence each."""
        found = [values for values in self.read_verdicts().values() if "error" in values]
        return [f"{v['method']} failed on {v['case']}: {v['error']}" for v in found]

    def read_verdicts(self) -> dict[tuple[str, int], dict[str, Any]]:
        """Return all verdicts by (method, case)."""
        return {
            (method, index): read_json(verdict_file(self.folder, method, index))
            for method in self.methods
            for index in range(self.count)
        }

    def unseal(self) -> list[Answer]:
        """Commit to all verdicts, then decrypt the answers; return them.

        Raises:
            InputError: a verdict is missing or was changed, or an answer is not what was
                committed to.
        """
        self._commit_verdicts()
        answers = self.folder / "answers.json"
        if not answers.exists():
            secret = Secret.load(self.check)
            opened = [self._open(index, secret.key) for index in range(self.count)]
            write_json(answers, {"seed": secret.seed, "key": secret.key.hex(), "answers": opened})
        committed = read_json(self.folder / "commitments.json")
        found = []
        for index, text in enumerate(read_json(answers)["answers"]):
            self._as_committed(index, text, committed)
            values = json.loads(text)
            values.pop("salt")
            found.append(Answer.from_json(values))
        return found

    def _open(self, index: int, key: bytes) -> str:
        file = sealed_file(self.folder, index)
        try:
            return decrypt(file.read_bytes(), key, str(file)).decode()
        except OSError as error:
            raise InputError(
                f"{file} cannot be read: {error.strerror}; begin a new check."
            ) from None

    def _as_committed(self, index: int, answer: str, committed: Mapping[str, str]) -> None:
        if digest(answer.encode()) != committed.get(case_name(index)):
            raise InputError(
                f"{self.folder}: the answer of {case_name(index)} is not what was committed to; "
                "begin a new check."
            )

    def _commit_verdicts(self) -> None:
        digests = {}
        for method in self.methods:
            for index in range(self.count):
                file = verdict_file(self.folder, method, index)
                if not file.exists():
                    raise InputError(
                        f"{file} is missing; finish the check with `fjr blind run` first."
                    )
                digests[str(file.relative_to(self.folder))] = digest(file.read_bytes())
        committed = self.folder / "verdicts.json"
        if not committed.exists():
            write_json(committed, digests)
        elif read_json(committed) != digests:
            raise InputError(f"{committed} does not match the verdicts; some were changed.")


def _have_made(order: dict[str, Any], made: Callable[[str, int], None]) -> None:
    """Run the case-making process; raise InputError with its last line if it fails."""
    command = [sys.executable, "-m", "fjr_validation.blind.maker"]
    pipes: dict[str, Any] = {
        "stdin": subprocess.PIPE,
        "stdout": subprocess.PIPE,
        "stderr": subprocess.PIPE,
    }
    with subprocess.Popen(command, text=True, **pipes) as process:
        assert process.stdin and process.stdout and process.stderr
        try:
            json.dump(order, process.stdin)
            process.stdin.close()
            for count, line in enumerate(process.stdout, 1):
                made(line.strip(), count)
            problem = process.stderr.read().strip()
        except BaseException:
            process.wait()
            raise
    if process.returncode:
        last = problem.splitlines()[-1] if problem else f"status {process.returncode}"
        raise InputError(f"The cases could not be made: {last}")
