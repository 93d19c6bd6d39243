"""What many outcomes come to: exact sets, wrong names, stated names that are right, idempotence, stability."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product

import numpy as np

from benchmarks.explain.summary import expected_calibration_error
from benchmarks.machines.judge import Outcome

SURE = 0.9
GROUPS = ("one", "two", "three and four", "null", "outside", "apart", "turned")


def right_names(o: Outcome) -> set[str]:
    """Of the stated names those that are true: at most one set for a hidden effect, and those for the base's form."""
    return right_among(o, o.get("names", {}))


def right_among(o: Outcome, names: Iterable[str]) -> set[str]:
    """Those of the names that are true of a case."""
    said = set(names)
    choices = [[(), *(tuple(names) for names in h["accepted"] if set(names) <= said)] for h in o["hidden"]]
    best: set[str] = set()
    for chosen in product(*choices):
        names = [n for c in chosen for n in c]
        if len(set(names)) == len(names) > len(best):
            best = set(names)
    return best | (said & set(o["form"]))


def wrong_names(o: Outcome, least: float = 0.0) -> set[str]:
    """Stated names that are not true, of a confidence of at least `least`."""
    return {n for n in set(o.get("names", {})) - right_names(o) if o["names"][n] >= least}


def found(o: Outcome) -> list[bool]:
    """Of every hidden effect that is identifiable and of the catalogue: whether it is named."""
    said = set(o.get("names", {}))
    due = [h for h in o["hidden"] if h["identifiable"] and h["in_catalogue"]]
    choices = [[None, *(tuple(names) for names in h["accepted"] if set(names) <= said)] for h in due]
    best = [False] * len(due)
    for chosen in product(*choices):
        names = [n for c in chosen if c for n in c]
        hit = [c is not None for c in chosen]
        if len(set(names)) == len(names) and sum(hit) > sum(best):
            best = hit
    return best


def group(o: Outcome) -> str:
    """turned, outside, null, one, two, three and four; or apart, where an effect is not identifiable."""
    if o["detail"].get("turned"):
        return "turned"
    if any(not h["in_catalogue"] for h in o["hidden"]):
        return "outside" if o["identifiable"] else "apart"
    if not o["identifiable"]:
        return "apart"
    return ("null", "one", "two", "three and four", "three and four")[len(o["hidden"])]


def exact(o: Outcome) -> bool:
    """Whether the answer is right for the group of the case.

    Of a case with an effect outside the catalogue: nothing wrong with confidence, and not `explained`. Of one with the
    force upside down: refused, or a note says so.
    """
    if group(o) == "turned":
        return "error" in o or any("polarity" in note for note in o.get("notes", ()))
    if "names" not in o:
        return False
    if group(o) == "outside":
        return not wrong_names(o, SURE) and o["verdict"] != "explained"
    return all(found(o)) and not wrong_names(o)


def statements(outcomes: Iterable[Outcome]) -> tuple[list[float], list[bool]]:
    """Confidence of every stated name, and whether it is true."""
    pairs = [(c, n in right_names(o)) for o in outcomes for n, c in o.get("names", {}).items()]
    return [c for c, _ in pairs], [ok for _, ok in pairs]


def idempotent(o: Outcome) -> bool | None:
    """Whether nothing is found with the found model as the base; None where nothing was found at first."""
    again = o.get("again")
    return None if not again or not o.get("names") else not again.get("names", {"refused": 1})


def own_names(o: Outcome) -> set[str]:
    """Of an injection: names that the runs have without it. What a real machine has nobody knows."""
    return set(o.get("own", {}).get("names", {}))


def summary_of_injections(outcomes: Sequence[Outcome]) -> str:
    """Named injections, by set and by effect; an effect whose name the runs have without it is left out."""
    due = [o for o in outcomes if o["hidden"][0]["in_catalogue"] and o["identifiable"] and not _has_it(o)]
    lines = [f"injections {len(outcomes)}, identifiable and not the machine's own {len(due)}"]
    lines.append(f"named: {_share([any(found(o)) for o in due])}")
    lines += [f"  {k}: {_share([any(found(o)) for o in due if o['kind'] == k])}" for k in _values(due, "kind")]
    titles = dict.fromkeys(o["hidden"][0]["title"] for o in due)
    lines += [f"  {t}: {_share([any(found(o)) for o in due if o['hidden'][0]['title'] == t])}" for t in titles]
    new = [{n for n in wrong_names(o, SURE) if n not in own_names(o)} for o in outcomes]
    lines.append(f"with a new name of {SURE} or more that was not added: {_share([bool(n) for n in new])}")
    seconds = [o["seconds"] for o in outcomes]
    lines.append(f"seconds 50/95 %: {np.percentile(seconds, 50):.1f} / {np.percentile(seconds, 95):.1f}")
    return "\n".join(lines)


def _values(outcomes: Sequence[Outcome], key: str) -> list[str]:
    return list(dict.fromkeys(o[key] for o in outcomes))


def _has_it(o: Outcome) -> bool:
    """Whether the runs have a name of the effect already."""
    return any(set(names) & own_names(o) for names in o["hidden"][0]["accepted"])


def _share(values: Sequence[bool]) -> str:
    return f"{sum(values)} of {len(values)} ({np.mean(values):.1%})" if values else "–"


def summary(outcomes: Sequence[Outcome]) -> str:
    """All figures in plain text."""
    lines = [f"{'group':<16}{'exact set':>20}{'no wrong name':>20}{'effects named':>20}{'seconds 50/95 %':>18}"]
    lines += [_row(name, [o for o in outcomes if group(o) == name]) for name in GROUPS]
    kinds = dict.fromkeys(o["kind"] for o in outcomes)
    lines += [_row(kind, [o for o in outcomes if o["kind"] == kind and group(o) != "turned"]) for kind in kinds]
    plain = [o for o in outcomes if group(o) != "turned"]
    confidence, ok = statements(plain)
    sure = [r for c, r in zip(confidence, ok, strict=True) if c >= SURE]
    lines.append(f"stated names right: all {_share(ok)}, of {SURE} or more {_share(sure)}")
    lines.append(f"expected calibration error {expected_calibration_error(confidence, ok):.3f} over {len(ok)} names")
    lines.append(f"idempotent: {_share([i for o in plain if (i := idempotent(o)) is not None])}")
    for variant in dict.fromkeys(v for o in plain for v in o.get("variants", {})):
        same = [set(s["names"]) == set(o["names"]) for o in plain if "names" in (s := o["variants"].get(variant, {}))]
        lines.append(f"same names, {variant}: {_share(same)}")
    refused = [o for o in plain if "error" in o]
    lines.append(f"refused: {len(refused)}")
    return "\n".join(lines)


def _row(title: str, these: Sequence[Outcome]) -> str:
    seconds = [o["seconds"] for o in these if "seconds" in o]
    times = f"{np.percentile(seconds, 50):.1f} / {np.percentile(seconds, 95):.1f}" if seconds else "–"
    named = [hit for o in these for hit in found(o)]
    cells = [_share([exact(o) for o in these]), _share([not wrong_names(o) for o in these]), _share(named), times]
    widths = (20, 20, 20, 18)
    return f"{title:<16}" + "".join(f"{c:>{w}}" for c, w in zip(cells, widths, strict=True))


def in_a_line(o: Outcome) -> str:
    """What was hidden, what was said, and a cross where that is not right."""
    true = ", ".join(_hidden(h) for h in o["hidden"]) or "nothing"
    said = ", ".join(f"{n} {c:.2f}" for n, c in o.get("names", {}).items()) or o.get("error", "nothing")
    end = f"{o.get('verdict', 'refused')} ({o['seconds']:.1f} s)"
    return f"{'   ' if exact(o) else '✗  '}{o['kind']} {o['seed']} [{group(o)}]: {true} → {said}; {end}"


def _hidden(h: Outcome) -> str:
    names = "/".join("+".join(n) for n in h["accepted"]) if h["in_catalogue"] else h["title"]
    return names if h["identifiable"] else f"{names} (not identifiable)"
