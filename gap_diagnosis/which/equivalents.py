"""Effects that may stand in for each other."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from fjr_sim_node import effects as fx

ONE_CAUSE = 0.04
"""Of the gap, beyond noise: where one of two near equivalents leaves no more alone, both together
are one cause whose law has another form than the catalogue's, by up to a fifth of what it does."""


def partners(found: Sequence[str], among: set[str], nominal: Mapping[str, float]) -> list[str]:
    """Return the near equivalents of effects, so that a set is never short of one not tried.

    Args:
        found: identifiers of the effects.
        among: identifiers that may be returned.
        nominal: bare parameters, which say whether the link is held.
    """
    held = "j" not in nominal and "k0" in nominal
    alike = {e for effect in found for e in fx.near_equivalents(effect, held=held)}
    return sorted(among & (alike | set(found)))


def holders(found: Sequence[str], among: Sequence[str], beside: Collection[str]) -> list[str]:
    """Return what holds one of some effects as a limit case and is not looked for by itself.

    A law of several parts, such as LuGre friction, is too costly to be tried on every rig, and not
    needed where one of its parts does as well; where one leads, the whole may be what is there. So
    it may where another torque of the angle leads: gravity goes before a spring that hardens.
    Beside one of its parts it would name that one twice: there the other part is what is looked
    for.

    Args:
        found: identifiers of what leads.
        among: what is looked for; a law counts where all its parts are.
        beside: identifiers of the explanation to which it is to be added.
    """
    leading = {*found}
    for effect in found:
        if fx.EFFECTS[effect].of_the_angle:
            alike = fx.near_equivalents(effect)
            leading |= {other for other in alike if fx.EFFECTS[other].of_the_angle}
    every = {other for effect in leading for other in fx.holders(effect)} - set(among)
    parts = {law: set(fx.EFFECTS[law].contains) for law in every}
    return sorted(law for law in every if parts[law] <= set(among) - set(beside))


def founded(
    effects: Sequence[str], beside: Collection[str], nominal: Mapping[str, float],
    among: Collection[str],
) -> list[str]:  # fmt: skip
    """Return those of some effects that have something to act on.

    Where the datasheet has no Coulomb friction at all, a part of it that depends on direction,
    angle or velocity would stand in for the whole: the whole goes first (the principle of
    marginality: Nelder 1977, JRSS-A 140(1)).

    Args:
        effects: identifiers.
        beside: identifiers of the explanation to which one of them is to be added.
        nominal: bare parameters of the datasheet.
        among: what is looked for; what brings in the whole counts only if it is.
    """

    def has_base(effect: str) -> bool:
        base = fx.EFFECTS[effect].modifies
        if not base or base in beside or base not in among:
            return True
        return any(nominal.get(p.adds_to) for p in fx.EFFECTS[base].parameters)

    return [effect for effect in effects if has_base(effect)]


def loaded(effects: Sequence[str], beside: Collection[str]) -> list[str]:
    """Return those of some effects that have a load to act on in a run in which no torque acts.

    Without a motor's torque the gear carries what gravity or a spring asks for, and else nothing: a
    loss in it would then act on the torque that holds the model to the record.

    Args:
        effects: identifiers.
        beside: identifiers of the explanation to which one of them is to be added.
    """
    carried = any(fx.EFFECTS[effect].load is not None for effect in beside)
    return [effect for effect in effects if carried or not fx.EFFECTS[effect].of_load]


def plainness(
    effects: Sequence[str], parameters: Sequence[str], laws: Sequence[Sequence[str]]
) -> tuple[bool, int, int]:
    """Return what puts the plainest of some explanations that do alike first.

    One that holds another as a limit case stands last: its further parameters lie at their bounds,
    where no test can call it present. Then the number of parameters counts, then how common it is.

    Args:
        effects: identifiers of the explanation.
        parameters: its free effect parameters.
        laws: effects of all explanations that do alike.
    """
    holds = any(fx.contains(effects, other) for other in laws)
    return holds, len(parameters), fx.rare(effects)
