"""The outcome of an inspection: whether its pose may be used, and how the part is."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from relmodel.errors import UsageError
from relmodel.store import Store

NOT_AS_MODELLED = ("changed", "contradicted", "variant", "unchecked")


@dataclass(frozen=True)
class Outcome:
    """A row of the view `inspection_outcome`, with the sentences of `found_variant`.

    verdict, pose_verdict, part_verdict, mood: as the view has them.  findings, checked, in_view, changed, contradicted,
    not_confirmed, undecidable: how many parts and features in view are so; None where the pose is refused.  variant:
    that the pictures show another variant than the world has; None where they do not, or none was weighed.  words: all
    of it, as "pose usable; part deviates (4 findings); 5 of 8 checked, ...".  variants: of each object of which several
    variants were weighed which one is shown, and what says so.  shown: which of the objects that the pictures were
    compared with they show; None where a world was given.  cause: why the pose is most likely not accepted, as
    the view `why_verdict_cause` says, and refusal: that in a sentence and what to do next in another; nothing where it
    is accepted.
    """

    verdict: str
    pose_verdict: str
    part_verdict: str
    mood: str
    findings: int | None
    checked: int | None
    in_view: int | None
    changed: int | None
    contradicted: int | None
    not_confirmed: int | None
    undecidable: int | None
    variant: str | None
    words: str
    variants: list[str]
    shown: str | None
    cause: str | None
    refusal: list[str]

    @property
    def unchecked(self) -> int | None:
        """How many parts and features in view are not confirmed or undecidable."""
        return None if self.in_view is None else self.in_view - (self.checked or 0)

    @property
    def is_usable(self) -> bool:
        return self.pose_verdict == "usable"

    def has(self, what: str) -> bool:
        """Whether one of NOT_AS_MODELLED is there."""
        return bool(getattr(self, what))

    def to_json(self) -> dict[str, Any]:
        return {**asdict(self), "unchecked": self.unchecked}


def read_outcome(store: Store, run: int) -> Outcome:
    """The outcome of an inspection that came to a verdict."""
    with store.read() as connection:
        (row,) = store.rows(connection, "run/outcome", run=run)
        variants = [r.sentence for r in store.rows(connection, "why/verdict/15_variants", run=run)]
        refusal = [r.sentence for r in store.rows(connection, "why/verdict/11_cause", run=run)]
        (shown, *_) = [r.sentence for r in store.rows(connection, "why/verdict/12_against", run=run)] or [None]
    return Outcome(**row._mapping, variants=variants, shown=shown, refusal=refusal)


def parse_not_as_modelled(given: str, option: str) -> list[str]:
    """Words of NOT_AS_MODELLED, separated by commas.  Raises UsageError for others."""
    words = [word.strip() for word in given.split(",")]
    unknown = [word for word in words if word not in NOT_AS_MODELLED]
    if unknown:
        raise UsageError(f"{option} does not know {unknown[0]!r}: give some of {','.join(NOT_AS_MODELLED)}")
    return words
