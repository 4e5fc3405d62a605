//! A check as its entry says.

use super::expression::{holds, number};
use super::text::Names;
use super::{CaseError, CheckEntry, Distance};
use taut_output::check::{Check, Measure};

/// A check as its entry says, of one run or of several.
pub(super) fn check(entry: &CheckEntry, names: &Names) -> Result<Check, CaseError> {
    let number = |text: &str| number(text, &names.values);
    let words =
        |text: &Option<String>| text.as_deref().map_or(Ok(String::new()), |t| names.text(t));
    let bar = || {
        let (key, place) = ("bar", "[[run.check]]");
        let missing = CaseError::Missing { key, place };
        let written = entry.bar.as_ref().ok_or(missing)?;
        match written.as_float().is_some_and(|bar| !bar.is_finite()) {
            true => Err(CaseError::message(&"a bar is finite").within(&written.to_string())),
            false => names.number(written),
        }
    };
    let case = names.text(&entry.case)?;
    let mut check = if let Some(condition) = &entry.holds {
        let (reference, ours) = (names.text(&entry.reference)?, words(&entry.ours)?);
        Check::stated(case, reference, ours, holds(number(condition)?))
    } else if let Some(both) = &entry.vector {
        let numbers = |texts: &Vec<String>| texts.iter().map(|text| number(text)).collect();
        let [reference, ours]: [Result<Vec<f64>, CaseError>; 2] = both.each_ref().map(numbers);
        let error = number(entry.error.as_deref().unwrap_or_default())?;
        let both = [&reference?[..], &ours?[..]];
        Check::vector(case, both, &entry.unit, [error, bar()?])
    } else if let Some(error) = &entry.error {
        let (error, reference) = (number(error)?, names.text(&entry.reference)?);
        match &entry.ours {
            Some(ours) => Check::within(case, reference, names.text(ours)?, error, bar()?),
            None => Check::off(case, reference, error, &entry.unit, bar()?),
        }
    } else {
        let (key, place) = ("ours", "[[run.check]]");
        let missing = CaseError::Missing { key, place };
        let ours = number(entry.ours.as_ref().ok_or(missing)?)?;
        let measure = match entry.measure {
            Some(Distance::Absolute) => Measure::Absolute,
            _ => Measure::Relative,
        };
        let both = [number(&entry.reference)?, ours];
        Check::number(case, both, entry.unit.clone(), measure, bar()?)
    };
    if entry.claim {
        check = check.published();
    }
    if let Some(by) = &entry.by {
        check = check.by(names.text(by)?);
    }
    check = check.with_note(words(&entry.note)?);
    if let Some(limit) = &entry.limit {
        check = check.limited(holds(number(&limit.when)?), names.text(&limit.cause)?);
    }
    let parts = &mut check.parts;
    for (part, text) in [
        (&mut parts.algebraic, &entry.algebraic),
        (&mut parts.time, &entry.time),
        (&mut parts.space, &entry.space),
    ] {
        *part = text.as_deref().map(number).transpose()?;
    }
    Ok(check)
}
