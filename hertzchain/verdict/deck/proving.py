"""Corrections that are proven: the deck is read and run with each, and compared with the scene."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

from hertzchain.engines.lammps.reading.text import Edits
from hertzchain.errors import RunFailed
from hertzchain.verdict.deck.deck_check import DeckCheck
from hertzchain.verdict.deck.examined import Correction, DeckExamination, Finding, by_command
from hertzchain.verdict.deck.places import Changes, place_at

_WORSE = 1e-2, 1e-5
"""Increase of the error of a peak that a correction may cause, relative to it and absolute:
readings are at other times, and the error of the steps changes with any number (chosen)."""

_MOST_STEPS = 30  # most corrections in succession (chosen)
_PATIENCE = 8.0, 8.0  # time for all proofs: readings of the deck, or seconds (chosen)

_NOT_ALL = (
    "not all corrections were tried in the time for that, eight readings of the deck or 8 s:"
    " correct what is shown, and examine the deck again"
)

Try = Callable[[Edits, float], DeckExamination]
Proof = tuple[Edits, DeckExamination]


@dataclass
class Prover:
    """Tries edits of a deck and keeps the results."""

    first: DeckExamination
    attempt: Try
    seconds: float  # time of the first examination
    cut_short: bool = False  # whether the time was over before all were tried
    _known: dict[object, DeckExamination | None] = field(default_factory=dict)
    _begun: float = field(default_factory=time.monotonic)

    @property
    def left(self) -> float:
        """Time for further proofs [s]."""
        readings, seconds = _PATIENCE
        return max(readings * self.seconds, seconds) - (time.monotonic() - self._begun)

    def examined(self, edits: Edits) -> DeckExamination | None:
        """Return the examination of the deck with edits; None if LAMMPS stops, or time is over."""
        if not edits:
            return self.first
        key = frozenset(edits.items())
        if key not in self._known:
            if self.left <= 0:
                self.cut_short = True
                return None
            try:
                self._known[key] = self.attempt(edits, self.left)
            except RunFailed:  # LAMMPS stops with an error, or takes too long
                self._known[key] = None
        return self._known[key]

    def proofs(
        self, base: Edits, before: DeckExamination, checks: Sequence[DeckCheck], peaks: bool = True
    ) -> Iterator[Proof]:
        """Return edits by which some checks pass, if nothing else fails and no peak is worse."""
        kinds = {check.kind for check in checks}
        for check in checks:
            for changes in check.corrections:
                whole = combined(base, changes)
                after = None if whole is None else self.examined(whole)
                if whole is None or after is None:
                    continue
                left = [one for one in after.to_correct if one.kind in kinds]
                if left and len(checks) > 1 and len(left) < len(checks):  # others on that line
                    yield from self.proofs(whole, before, left, peaks)
                elif not left and is_no_worse(before, after, peaks):
                    yield whole, after


def with_findings(prover: Prover) -> DeckExamination:
    """Return the first examination with findings by command, and proven corrections."""
    first = prover.first
    groups, proofs = by_command(first.to_correct), list[Proof | None]()
    for checks in groups:
        follows = _cause(checks, proofs) is not None
        proofs.append(None if follows else next(prover.proofs({}, first, checks), None))
    # A later finding may be the cause of an earlier one.
    causes = [
        _cause(checks, proofs) if proof is None else None
        for checks, proof in zip(groups, proofs, strict=True)
    ]
    whole, steps = _together(prover)
    if prover.cut_short:  # what is shown as right is in the fixed deck, though it was not tried
        for proof in proofs:
            more = {} if proof is None else proof[0]
            if not more.keys() & whole.keys():
                whole = {**whole, **more}
    corrections, known = [], {check.kind for check in first.to_correct}
    for checks, proof, cause in zip(groups, proofs, causes, strict=True):
        # A check that fails only then belongs to the same number, such as the stiffness of the
        # wall.
        left = {check.kind for check in (proof[1].to_correct if proof else checks)}
        later = [one for named, one in steps if named & (left - known if proof else left)]
        edits = {**(proof[0] if proof else {}), **(later[0] if later else {})}
        corrections.append(first.corrections_of(edits) if edits and cause is None else ())
    right = {
        id(check): _with_correction(first, check, corrections[k])
        for k, checks in enumerate(groups)
        for check in checks
    }

    def with_command(check: DeckCheck) -> DeckCheck:
        return right.get(id(check), check)

    # Findings that follow from another one are listed after it.
    heads = [k if cause is None else cause for k, cause in enumerate(causes)]
    order = sorted(range(len(groups)), key=lambda k: (heads[k], heads[k] != k))
    findings = [
        Finding(
            tuple(map(with_command, groups[k])), corrections[k],
            with_others=proofs[k] is None and bool(corrections[k]),
            follows=None if heads[k] == k else order.index(heads[k]),
        )
        for k in order
    ]  # fmt: skip
    return replace(
        first, checks=tuple(map(with_command, first.checks)), findings=tuple(findings), edits=whole,
        remarks=(*first.remarks, *[_NOT_ALL] * prover.cut_short),
    )  # fmt: skip


def _with_correction(
    first: DeckExamination, check: DeckCheck, lines: Sequence[Correction]
) -> DeckCheck:
    """Return a check with its proven command; a variable that is right is not named."""
    at, commands = check.place, first.found.commands
    own = next((one for one in lines if at and (one.file, one.line) == (at.file, at.line)), None)
    others = [one for one in lines if one.written not in one.commands]
    if own is None and others and at is not None and at.written.startswith("variable"):
        own = others[0]
        index = next(k for k, one in enumerate(commands) if one.written == own.written
                     and (one.file, one.line) == (own.file, own.line))  # fmt: skip
        at = place_at(first.found, index)
    return check if own is None else replace(check, command="\n".join(own.commands), place=at)


def _cause(checks: Sequence[DeckCheck], proofs: Sequence[Proof | None]) -> int | None:
    """Return the correction of another finding that makes some checks pass, too."""
    kinds = {check.kind for check in checks}
    for k, proof in enumerate(proofs):
        after = None if proof is None else proof[1]
        if after is None or after.found.stopped:
            continue
        if not kinds & {check.kind for check in after.to_correct}:
            return k
    return None


def is_no_worse(before: DeckExamination, after: DeckExamination, peaks: bool = True) -> bool:
    """Whether all checks that passed before still pass, and no peak is worse."""
    if after.found.stopped and not before.found.stopped:
        return False
    passed = {check.kind for check in before.checks if check.passed}
    passed -= {check.kind for check in before.to_correct}
    if any(check.kind in passed for check in after.to_correct):
        return False
    if not peaks or before.found.stopped:
        return True
    count = min(before.judged.size, after.judged.size)
    both = before.judged[:count] & after.judged[:count]
    was, now = (one.error_of_peaks(both) for one in (before, after))
    share, least = _WORSE
    return bool(now <= was * (1 + share) + least)


def _together(prover: Prover) -> tuple[Edits, list[tuple[set[str], Edits]]]:
    """Combine corrections in succession until none helps; return what each of them adds."""
    edits: Edits = {}
    done = prover.first
    steps: list[tuple[set[str], Edits]] = []
    for peaks in (True, False):  # errors that make up for one another: only all of them help
        tried, state, own = edits, done, list[tuple[set[str], Edits]]()
        stuck: set[str] = set()
        for _ in range(_MOST_STEPS):
            checks = next(
                (group for group in by_command(state.to_correct)
                 if not {check.kind for check in group} & stuck), None,
            )  # fmt: skip
            if checks is None:
                break
            kinds = {check.kind for check in checks}
            proof = next(prover.proofs(tried, state, checks, peaks), None)
            if proof is None:
                stuck |= kinds
                continue
            added = {at: lines for at, lines in proof[0].items() if tried.get(at) != lines}
            own.append((kinds, added))
            tried, state = proof
        if peaks or is_no_worse(done, state):
            edits, done = tried, state
            steps += own
        if done.passed:
            break
    return edits, steps


def combined(base: Edits, changes: Changes) -> Edits | None:
    """Return edits with further changes; None if a command that these change is gone."""
    whole = dict(base)
    for (file, line, written), lines in changes.items():
        own = whole.get((file, line), (written,))
        if written not in own:
            return None
        k = own.index(written)
        whole[file, line] = (*own[:k], *lines, *own[k + 1 :])
    return whole
