"""A doubtful name is taken out, and what it leaves behind is no doubt about the others."""

from __future__ import annotations

from identification.criteria import FORM
from identification.discrepancy import naming
from identification.discrepancy.evidence import gather
from identification.discrepancy.excess import excess_of
from identification.discrepancy.trials import trial_of
from identification.discrepancy.verdict import drop_doubtful
from identification.fitting.leastsquares import fit_records
from identification.physical.model import element
from identification.record import Record
from tests.identification.specimens import AS_SIMULATED, records_with


def found_with(*names: str, records: list[Record]) -> naming.Search:
    """What a search that ends with these names stands on, each compared with nothing else."""
    first = {"linear_stiffness": {"k": 2000.0}, "moving_mass": {"m": 0.1}}
    model = AS_SIMULATED
    for name in names:
        model = model.with_element(element(name, first[name]))
    fit = fit_records(model, records)
    compared = {}
    for name in names:
        rest = fit_records(fit.model.without(name), records)
        own = trial_of(fit, name, rest, records, screened=1.0)
        beside = tuple(n for n in names if n != name)
        compared[name] = naming.Compared(without=rest, start=rest, beside=beside, rivals=(own,))
    base = fit_records(AS_SIMULATED, records)
    return naming.Search(
        fit=fit, names=names, excess=excess_of(fit), given=AS_SIMULATED, base_excess=excess_of(base), compared=compared
    )


def test_a_name_keeps_its_evidence_when_a_doubtful_one_beside_it_is_taken_out() -> None:
    records = records_with("linear_stiffness")
    found = found_with("linear_stiffness", "moving_mass", records=records)
    before = {e.name: e for e in gather(found, records)}
    assert before["moving_mass"].confidence < FORM.min_confidence <= before["linear_stiffness"].confidence
    kept, stated, withheld = drop_doubtful(found, records)
    assert kept.names == kept.fit.model.ids[len(AS_SIMULATED.elements) :] == ("linear_stiffness",)
    assert stated == [before["linear_stiffness"]]
    assert withheld == [before["moving_mass"]]


def test_where_no_name_is_doubtful_nothing_is_fitted_again() -> None:
    records = records_with("linear_stiffness")
    found = found_with("linear_stiffness", records=records)
    kept, stated, withheld = drop_doubtful(found, records)
    assert kept is found
    assert [e.name for e in stated] == ["linear_stiffness"]
    assert withheld == []
