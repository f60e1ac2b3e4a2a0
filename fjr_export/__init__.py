"""The joint in other tools: MuJoCo, URDF, python-control, Simscape, from one parameter file.

The parameters of a rig go in, such as those that a diagnosis has updated; a file of the tool comes
out, and what became of each part (`result`). Begin with `exporting`. `treatments` says what each
tool makes of each effect of the catalogue: natively, by an equivalent, or not at all. `joint` is
what is exported, `spring` its transmission as springs with dead bands. `mjcf`,
`urdf`, `linear` and `simscape` write the files; `targets` runs those that run here, and `replay`
plays recorded runs in them, in the loop in which they were recorded.

    >>> from fjr_export import export
    >>> made = export("rig/campaign.yaml", "mjcf", "exported")
    >>> made.file, made.time_step_s
    ('joint.xml', 0.0001)
    >>> [(part.effect, part.kind) for part in made.effects if part.kind != "native"]
    []
"""

from typing import TYPE_CHECKING

from fjr_kit.public_names import deferred_names

if TYPE_CHECKING:
    from .exporting import export
    from .result import Export
else:
    __getattr__, __dir__ = deferred_names(__name__)

__all__ = ["Export", "export"]
