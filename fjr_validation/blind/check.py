"""Runs a blind check: cases made and sealed, verdicts kept, only then answers unsealed.

The protocol, and what it is worth: processes of their own make the cases and give out bags and
encrypted answers with their SHA-256. The diagnosis processes are told the folder of one case's bags
and nothing else; key and seed are in neither their arguments, nor their environment, nor the folder
of the check, but in a file of the user's state folder. When every case has its verdicts, the
SHA-256 of them all is written down; then the answers are decrypted, compared with what was
committed to, and scored. After that no verdict is made or replaced. This guards against a method
that sees an answer by accident or by convenience, and lets others check that neither answers nor
verdicts were changed. It does not guard against a user who breaks his own seal: who knows the seed
can make the cases again, and who owns the state folder can read the key.

OUT/blind.json        what the check is: identity, cases of each world, methods, frozen sources
OUT/sealed.jsonl      a sealed answer for each case that was made; the last one of a case counts
OUT/verdicts.jsonl    a verdict for each case and method, as soon as it is there
OUT/cases/            bags of the cases that are under way, removed once all methods have seen them
OUT/unsealed.json     seed, key and SHA-256 of the verdicts
OUT/answers.jsonl     the answers, unsealed
OUT/report/           scores, figures, report
"""

from __future__ import annotations

import json
import secrets
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from fjr_kit.atomic import write_whole
from fjr_kit.errors import InputError
from fjr_kit.installed import product_version

from .answers import WORLDS, Answer, World
from .check_documents import Manifest, Unsealed
from .frozen import frozen_digest
from .json_lines import JsonLines
from .lanes import Job, finished_jobs
from .making import make_sealed
from .methods import check_methods, verdicts
from .seal import Secret, digest, opened_line

Report = Callable[[int, int, str], None]
"""Called with (done, all, what was done)."""


@dataclass(frozen=True)
class Case:
    """One case of a check."""

    world: World
    number: int

    @property
    def name(self) -> str:
        """Its name, which says its world and nothing else."""
        return f"{self.world}_{self.number:04d}"


def split(count: int, worlds: Sequence[World]) -> dict[str, int]:
    """Return how many of `count` cases each world gets: the same, the first ones what is over."""
    chosen = [world for world in WORLDS if world in worlds]
    return {
        world: count // len(chosen) + (place < count % len(chosen))
        for place, world in enumerate(chosen)
    }


@dataclass(frozen=True)
class BlindCheck:
    """A blind check in its folder.

    Attributes:
        folder: where it is.
        manifest: what it is.
    """

    folder: Path
    manifest: Manifest

    @classmethod
    def begin(
        cls, folder: Path, cases: Mapping[str, int], seed: int | None, methods: Sequence[str]
    ) -> BlindCheck:
        """Begin a check, or take up the one in the folder.

        Raises:
            InputError: the folder holds another check, one that was begun on another machine, or
                one whose frozen sources have changed.
        """
        if (there := cls.ordered(folder, cases, seed, methods)) is not None:
            return there
        begun = Manifest(
            check=secrets.token_hex(8),
            cases=dict(cases),
            methods=tuple(methods),
            frozen=frozen_digest(),
            version=product_version(),
        )
        Secret.draw(seed).save(begun.check)
        folder.mkdir(parents=True, exist_ok=True)
        write_whole(folder / "blind.json", begun.to_json())
        return cls(folder, begun)

    @classmethod
    def ordered(
        cls, folder: Path, cases: Mapping[str, int], seed: int | None, methods: Sequence[str]
    ) -> BlindCheck | None:
        """Return the check in the folder, None if there is none and one may be begun there.

        Raises:
            InputError: as `begin`.
        """
        check_methods(methods)
        if (folder / "blind.json").exists():
            return cls.open(folder)._as_ordered(cases, seed, methods)
        if folder.exists() and any(folder.iterdir()):
            raise InputError(f"{folder} holds something else; choose another folder.")
        return None

    @classmethod
    def open(cls, folder: Path) -> BlindCheck:
        """Open the check of a folder; raise InputError if there is none."""
        manifest = folder / "blind.json"
        if not manifest.exists():
            raise InputError(f"{folder} holds no blind check; begin one with `fjr blind run`.")
        return cls(folder, Manifest.read(manifest))

    def _as_ordered(
        self, cases: Mapping[str, int], seed: int | None, methods: Sequence[str]
    ) -> BlindCheck:
        """Return this check; raise InputError if what is ordered now is another one."""
        begun = self.manifest
        if dict(cases) != begun.cases or set(methods) != set(begun.methods):
            worlds = ", ".join(f"{count} {world}" for world, count in begun.cases.items())
            raise InputError(
                f"{self.folder} holds a check of other cases or methods ({worlds}; "
                f"{', '.join(begun.methods)}); order the same, or choose another folder."
            )
        if seed is not None and not self.unsealed and Secret.load(begun.check).seed != seed:
            raise InputError(f"{self.folder} holds a check of another seed; choose another folder.")
        if not self.unsealed and begun.frozen != frozen_digest():
            raise InputError(
                f"{self.folder}: how cases are made or scored has changed since this check began "
                f"(frozen as {begun.frozen[:12]}); go back to that version, or begin a new check."
            )
        return self

    @cached_property
    def cases(self) -> tuple[Case, ...]:
        """All cases, the worlds mixed so that a part of a check holds a part of each."""
        numbered = [
            ((number + 0.5) / count, world, number)
            for world, count in self.manifest.cases.items()
            for number in range(count)
        ]
        return tuple(Case(world, number) for _, world, number in sorted(numbered))  # type: ignore[arg-type]

    @property
    def unsealed(self) -> bool:
        """Whether the answers have been unsealed."""
        return (self.folder / "unsealed.json").exists()

    @property
    def _verdicts(self) -> JsonLines:
        return JsonLines(self.folder / "verdicts.jsonl")

    @property
    def _sealed(self) -> JsonLines:
        return JsonLines(self.folder / "sealed.jsonl")

    def verdicts(self) -> list[dict[str, Any]]:
        """Return all verdicts that are there."""
        return self._verdicts.read()

    def missing(self) -> list[Case]:
        """Return the cases that lack a verdict of some method."""
        seen = {(line["case"], line["method"]) for line in self.verdicts()}
        methods = self.manifest.methods
        return [case for case in self.cases if any((case.name, m) not in seen for m in methods)]

    def check_seals(self) -> None:
        """Open every seal that is there, and forget what it holds: what unsealing will rest on.

        Raises:
            InputError: the key cannot be read, or a seal is not what was committed to.
        """
        if not self.unsealed:
            key = Secret.load(self.manifest.check).key
            for line in self._sealed.read():
                opened_line(line, key)

    def run(
        self,
        scheduler: str | None = None,
        workers: int | None = None,
        report: Report = lambda *_: None,
        *,
        keep_bags: bool = False,
    ) -> None:
        """Make each case that lacks a verdict and put every method to it, several side by side.

        Raises:
            InputError: the answers are unsealed, no scheduler answers, or a process died.
        """
        missing = self.missing()
        if missing and self.unsealed:
            raise InputError(
                f"{self.folder} lacks verdicts, but its answers are unsealed; begin a new check."
            )
        done, total = len(self.cases) - len(missing), len(self.cases)
        sealed, kept = self._sealed, self._verdicts
        known = {(line["case"], line["method"]) for line in kept.read()}
        for job, lines in finished_jobs(self._jobs(missing), sealed.append, scheduler, workers):
            if not keep_bags:  # first, for nobody looks again at the folder of a case with verdicts
                shutil.rmtree(job.folder, ignore_errors=True)
            new = [line for line in lines if (line["case"], line["method"]) not in known]
            kept.append(*new)
            done += 1
            said = ", ".join(line.get("error") or line["diagnosis"]["verdict"] for line in lines)
            report(done, total, f"{job.name}: {said}")

    def _jobs(self, cases: Sequence[Case]) -> Iterator[Job]:
        """Yield what is to be done, clearing away what an interrupted run left of the case."""
        if not cases:
            return
        secret = Secret.load(self.manifest.check)
        for case in cases:
            folder = (self.folder / "cases" / case.name).absolute()
            shutil.rmtree(folder, ignore_errors=True)
            order = {"case": case.name, "folder": folder}
            made = {"world": case.world, "number": case.number, "seed": secret.seed}
            yield Job(
                case.name,
                folder,
                (make_sealed, {**order, **made, "key": secret.key}),
                (verdicts, {**order, "methods": self.manifest.methods}),
            )

    def unseal(self, *, unfinished: bool = False) -> list[tuple[str, Answer]]:
        """Commit to all verdicts, then decrypt the answers; return those of cases with verdicts.

        Args:
            unfinished: end the check here though cases lack verdicts.

        Raises:
            InputError: a verdict is missing or was changed, or an answer is not what was
                committed to.
        """
        missing = self.missing()
        if missing and not unfinished and not self.unsealed:
            raise InputError(
                f"{self.folder} lacks the verdicts on {len(missing)} of {len(self.cases)} cases; "
                "finish it with `fjr blind run`, or end it here with --unfinished."
            )
        verdicts_sha256 = digest(self._verdicts.path.read_bytes() if self.verdicts() else b"")
        if not self.unsealed:
            self._open_all(verdicts_sha256, finished=not missing)
        opened = Unsealed.read(self.folder / "unsealed.json")
        if opened.verdicts_sha256 != verdicts_sha256:
            raise InputError(
                f"{self._verdicts.path} is not what was committed to before unsealing; some "
                "verdicts were changed."
            )
        answers = JsonLines(self.folder / "answers.jsonl").read()
        return [(line.pop("case"), Answer.from_json(line)) for line in answers]

    def _open_all(self, verdicts_sha256: str, *, finished: bool) -> None:
        secret = Secret.load(self.manifest.check)
        last = {line["case"]: line for line in self._sealed.read()}
        missing = {case.name for case in self.missing()}
        lines = [
            json.dumps(opened_line(last[case.name], secret.key), separators=(",", ":"))
            for case in self.cases
            if case.name not in missing
        ]
        write_whole(self.folder / "answers.jsonl", "".join(line + "\n" for line in lines))
        unsealed = Unsealed(
            seed=secret.seed,
            key=secret.key.hex(),
            verdicts_sha256=verdicts_sha256,
            finished=finished,
        )
        write_whole(self.folder / "unsealed.json", unsealed.to_json())
