//! Formulas in the files of cases: numbers, names, functions and operators, over the steps of a run.
//!
//! A value is a series, one number a step or a single one, which goes with any series. Operators, from loose to tight:
//! `or`, `and`, comparisons, `+ -`, `* /`, the sign, `^`; what holds is 1, what does not is 0. Functions act number by
//! number ([`FUNCTIONS`], with the oracles) or reduce a series to one number ([`REDUCERS`]), where a second argument
//! picks the numbers at which it holds: `largest(ball.z, time > 0.5)`. NaN goes through all of them, and holds nowhere.
//! A name with other signs than letters, digits, `_` and `.` stands in brackets: `[bar-end.fz]`.

use super::CaseError;
use super::frequency;
use super::oracles::ORACLES;
use crate::energy::{Pendulum, pendulum};
use crate::hard::worse;
use crate::law;
use std::collections::BTreeMap;

/// A formula, as a tree of its functions.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Formula {
    Number(f64),
    Name(String),
    /// A function or an operator of its arguments.
    Call(String, Vec<Formula>),
}

/// A function of numbers: name, count of arguments, and the function.
pub(super) type Function = (&'static str, usize, fn(&[f64]) -> f64);

const FUNCTIONS: &[Function] = &[
    ("or", 2, |x| {
        decided(x, holds(x[0]) || holds(x[1]), holds(x[0]) || holds(x[1]))
    }),
    ("and", 2, |x| {
        decided(x, holds(x[0]) && holds(x[1]), x[0] == 0.0 || x[1] == 0.0)
    }),
    ("<", 2, |x| decided(x, x[0] < x[1], false)),
    (">", 2, |x| decided(x, x[0] > x[1], false)),
    ("<=", 2, |x| decided(x, x[0] <= x[1], false)),
    (">=", 2, |x| decided(x, x[0] >= x[1], false)),
    ("==", 2, |x| decided(x, x[0] == x[1], false)),
    ("+", 2, |x| x[0] + x[1]),
    ("-", 2, |x| x[0] - x[1]),
    ("*", 2, |x| x[0] * x[1]),
    ("/", 2, |x| x[0] / x[1]),
    ("^", 2, |x| x[0].powf(x[1])),
    ("negative", 1, |x| -x[0]),
    ("not", 1, |x| decided(x, x[0] == 0.0, false)),
    ("if", 3, |x| {
        let chosen = if holds(x[0]) { x[1] } else { x[2] };
        if x[0].is_nan() { f64::NAN } else { chosen }
    }),
    ("abs", 1, |x| x[0].abs()),
    ("sqrt", 1, |x| x[0].sqrt()),
    ("exp", 1, |x| x[0].exp()),
    ("ln", 1, |x| x[0].ln()),
    ("sin", 1, |x| x[0].sin()),
    ("cos", 1, |x| x[0].cos()),
    ("tan", 1, |x| x[0].tan()),
    ("asin", 1, |x| x[0].asin()),
    ("acos", 1, |x| x[0].acos()),
    ("atan", 1, |x| x[0].atan()),
    ("atan2", 2, |x| x[0].atan2(x[1])),
    ("sinh", 1, |x| x[0].sinh()),
    ("cosh", 1, |x| x[0].cosh()),
    ("asinh", 1, |x| x[0].asinh()),
    ("hypot", 2, |x| x[0].hypot(x[1])),
    ("mod", 2, |x| x[0].rem_euclid(x[1])),
    ("floor", 1, |x| x[0].floor()),
    ("min", 2, |x| smaller(x[0], x[1])),
    ("max", 2, |x| worse(x[0], x[1])),
];

/// One number of many: name and reduction. One NaN makes it NaN, and so does nothing at all for all but the sum.
type Reducer = (&'static str, fn(&[f64]) -> f64);

const REDUCERS: &[Reducer] = &[
    ("first", |x| x.first().copied().unwrap_or(f64::NAN)),
    ("last", |x| x.last().copied().unwrap_or(f64::NAN)),
    ("largest", |x| {
        x.iter().copied().reduce(worse).unwrap_or(f64::NAN)
    }),
    ("smallest", |x| {
        x.iter().copied().reduce(smaller).unwrap_or(f64::NAN)
    }),
    ("total", |x| x.iter().sum()),
    ("mean", |x| x.iter().sum::<f64>() / x.len() as f64),
    ("rms", |x| {
        (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt()
    }),
];

/// Functions of whole series: name and count of arguments; `functions.txt` has their meanings.
const OF_SERIES: &[(&str, usize)] = &[
    ("start", 1),
    ("before", 1),
    ("since", 1),
    ("cumulated", 1),
    ("running", 2),
    ("period", 2),
    ("half_period", 2),
    ("frequency", 3),
    ("slower_frequency", 3),
    ("faster_frequency", 3),
    ("amplitude", 4),
    ("other_motion", 4),
    // By the weights, Ω and θ of a step's law: how far modulus (relative) and phase (rad) of the largest root are from it.
    ("law_error", 6),
];

fn truth(holds: bool) -> f64 {
    f64::from(u8::from(holds))
}

/// True of a condition that holds, and of no NaN.
pub(super) fn holds(condition: f64) -> bool {
    condition != 0.0 && !condition.is_nan()
}

/// The truth of a statement, NaN of one about NaN, unless it is `known` all the same.
fn decided(of: &[f64], statement: bool, known: bool) -> f64 {
    if !known && of.iter().any(|x| x.is_nan()) {
        f64::NAN
    } else {
        truth(statement)
    }
}

/// The smaller number, NaN where either is.
fn smaller(a: f64, b: f64) -> f64 {
    if a < b || a.is_nan() { a } else { b }
}

/// All functions that a formula may name.
pub(super) fn known() -> impl Iterator<Item = &'static str> {
    let plain = FUNCTIONS.iter().chain(ORACLES).map(|(name, ..)| *name);
    let reducers = REDUCERS.iter().map(|(name, _)| *name);
    let series = OF_SERIES.iter().map(|(name, _)| *name);
    let words = |name: &&str| name.starts_with(char::is_alphabetic);
    plain.chain(reducers).chain(series).filter(words)
}

/// Values of the names in a formula.
#[derive(Debug, Clone, Default)]
pub(super) struct Values {
    /// One number a step, or a single one.
    pub(super) known: BTreeMap<String, Vec<f64>>,
    /// Those of the beginning, of what is seen in each step.
    pub(super) starts: BTreeMap<String, Vec<f64>>,
    /// The known ones are those of the beginning.
    at_start: bool,
}

impl Values {
    pub(super) fn set(&mut self, name: &str, value: f64) {
        self.known.insert(name.to_owned(), vec![value]);
    }
}

impl Formula {
    pub(super) fn read(text: &str) -> Result<Self, CaseError> {
        let mut reader = Reader {
            text,
            at: 0,
            depth: 0,
        };
        let formula = reader.level(0)?;
        if reader.peek().is_some() {
            return Err(reader.fault("the end"));
        }
        Ok(formula)
    }

    /// The names in it, each once or more.
    pub(super) fn names<'a>(&'a self, found: &mut Vec<&'a str>) {
        match self {
            Self::Number(_) => {}
            Self::Name(name) => found.push(name),
            Self::Call(_, arguments) => arguments.iter().for_each(|a| a.names(found)),
        }
    }

    pub(super) fn series(&self, values: &Values) -> Result<Vec<f64>, CaseError> {
        let (function, arguments) = match self {
            Self::Number(x) => return Ok(vec![*x]),
            Self::Name(name) => {
                let found = values.known.get(name).cloned();
                let known = || values.known.keys().map(String::as_str);
                return found.ok_or_else(|| CaseError::unknown("value", name, known()));
            }
            Self::Call(function, arguments) => (function.as_str(), arguments),
        };
        if function == "start" {
            return arguments[0].at_start(values);
        }
        if function == "before" {
            let mut series = arguments[0].at_start(values)?;
            series.extend(arguments[0].series(values)?);
            series.pop();
            return Ok(series);
        }
        let all: Result<Vec<_>, _> = arguments.iter().map(|a| a.series(values)).collect();
        let all = all?;
        if let Some((.., of)) = plain(function) {
            return each(&all, *of);
        }
        if let Some((_, reduce)) = REDUCERS.iter().find(|(name, _)| *name == function) {
            let picked = match all.get(1) {
                Some(_) => each(&all, |x| if x[1].is_nan() { x[1] } else { x[0] })?
                    .into_iter()
                    .zip(each(&all, |x| x[1])?)
                    .filter_map(|(x, holds)| (holds != 0.0).then_some(x))
                    .collect(),
                None => all[0].clone(),
            };
            return Ok(vec![reduce(&picked)]);
        }
        Ok(of_series(function, &all, values.at_start))
    }

    /// Its value at the beginning.
    pub(super) fn at_start(&self, values: &Values) -> Result<Vec<f64>, CaseError> {
        let mut begun = values.clone();
        begun.at_start = true;
        begun.known.extend(values.starts.clone());
        self.series(&begun)
    }

    /// Its number, which has to be the same everywhere.
    pub(super) fn number(&self, values: &Values) -> Result<f64, CaseError> {
        let series = self.series(values)?;
        let first = series.first().copied().unwrap_or(f64::NAN);
        let same = |x: &f64| x.to_bits() == first.to_bits();
        if series.iter().all(same) {
            Ok(first)
        } else {
            Err(CaseError::Varies)
        }
    }
}

/// A function of whole series, of those of the beginning where they are `at_start`.
fn of_series(function: &str, all: &[Vec<f64>], at_start: bool) -> Vec<f64> {
    match function {
        "since" => {
            let mut held = false;
            let since = all[0].iter().map(|x| {
                held |= holds(*x);
                truth(held)
            });
            since.collect()
        }
        "cumulated" if at_start => vec![0.0],
        "cumulated" => {
            let mut sum = 0.0;
            let so_far = all[0].iter().map(|x| {
                sum += x;
                sum
            });
            so_far.collect()
        }
        "running" => {
            let window = all[1][0] as usize;
            let mean = |n: usize| {
                let from = (n + 1).saturating_sub(window);
                all[0][from..=n].iter().sum::<f64>() / window as f64
            };
            (0..all[0].len()).map(mean).collect()
        }
        "amplitude" | "other_motion" => {
            let [dt, from, rate] = [1, 2, 3].map(|k| all[k][0]);
            let found = pendulum(&all[0], dt, from, rate);
            let of = |found: Pendulum| match function {
                "amplitude" => found.amplitude,
                _ => found.rest,
            };
            vec![found.map_or(f64::NAN, of)]
        }
        "law_error" => {
            let expected = law::weighed(&[1, 2, 3, 4, 5].map(|k| all[k][0]));
            vec![law::distance(&all[0], &expected)]
        }
        "period" | "half_period" => {
            let found = frequency::passages(&all[0], function == "period", 1.0);
            let between = found.windows(2).next().map(|pair| pair[1] - pair[0]);
            vec![between.map_or(f64::NAN, |steps| steps * all[1][0])]
        }
        _ => {
            let [expected, interval] = [all[1][0], all[2][0]];
            let stride = frequency::stride(expected, interval);
            let found = match function {
                "slower_frequency" => frequency::pair(&all[0], interval, stride)[0],
                "faster_frequency" => frequency::pair(&all[0], interval, stride)[1],
                _ => frequency::single(&all[0], interval, stride),
            };
            vec![found]
        }
    }
}

/// The number of a formula's text.
pub(super) fn number(text: &str, values: &Values) -> Result<f64, CaseError> {
    Formula::read(text)
        .and_then(|formula| formula.number(values))
        .map_err(|e| e.within(text))
}

fn plain(name: &str) -> Option<&'static Function> {
    FUNCTIONS
        .iter()
        .chain(ORACLES)
        .find(|(known, ..)| *known == name)
}

/// A function number by number; single numbers go with any series.
fn each(all: &[Vec<f64>], of: fn(&[f64]) -> f64) -> Result<Vec<f64>, CaseError> {
    let count = all.iter().map(Vec::len).find(|n| *n != 1).unwrap_or(1);
    if all.iter().any(|x| x.len() != 1 && x.len() != count) {
        return Err(CaseError::Varies);
    }
    let mut arguments = vec![0.0; all.len()];
    let at = |n: usize| {
        for (argument, series) in arguments.iter_mut().zip(all) {
            *argument = series[if series.len() == 1 { 0 } else { n }];
        }
        of(&arguments)
    };
    Ok((0..count).map(at).collect())
}

/// Operators, from loose to tight.
const LEVELS: [&[&str]; 5] = [
    &["or"],
    &["and"],
    &["<=", ">=", "==", "<", ">"],
    &["+", "-"],
    &["*", "/"],
];

/// Most parts of a formula inside each other.
const DEEPEST: usize = 100;

struct Reader<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
}

impl Reader<'_> {
    /// What is left, without spaces before it.
    fn peek(&mut self) -> Option<char> {
        let rest = &self.text[self.at..];
        self.at += rest.len() - rest.trim_start().len();
        self.text[self.at..].chars().next()
    }

    fn takes(&mut self, token: &str) -> bool {
        self.peek();
        let Some(rest) = self.text[self.at..].strip_prefix(token) else {
            return false;
        };
        let word = token.starts_with(char::is_alphabetic);
        if word && rest.starts_with(|c: char| c.is_alphanumeric() || c == '_') {
            return false;
        }
        self.at += token.len();
        true
    }

    fn fault(&self, expected: &'static str) -> CaseError {
        let found = self.text[self.at..].to_owned();
        CaseError::Formula { expected, found }
    }

    fn level(&mut self, level: usize) -> Result<Formula, CaseError> {
        let Some(operators) = LEVELS.get(level) else {
            return self.signed();
        };
        let mut left = self.level(level + 1)?;
        while let Some(operator) = operators.iter().find(|o| self.takes(o)) {
            let right = self.level(level + 1)?;
            left = Formula::Call((*operator).to_owned(), vec![left, right]);
        }
        Ok(left)
    }

    fn signed(&mut self) -> Result<Formula, CaseError> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.fault("the end of 100 nested parts"));
        }
        let formula = self.with_sign();
        self.depth -= 1;
        formula
    }

    fn with_sign(&mut self) -> Result<Formula, CaseError> {
        if self.takes("-") {
            return Ok(Formula::Call("negative".to_owned(), vec![self.signed()?]));
        }
        let base = self.atom()?;
        if self.takes("^") {
            let power = self.signed()?;
            return Ok(Formula::Call("^".to_owned(), vec![base, power]));
        }
        Ok(base)
    }

    fn atom(&mut self) -> Result<Formula, CaseError> {
        if self.takes("(") {
            let inner = self.level(0)?;
            let closed = self.takes(")");
            return closed.then_some(inner).ok_or_else(|| self.fault("`)`"));
        }
        let first = self.peek();
        if first.is_some_and(|c| c.is_ascii_digit()) {
            return self.digits();
        }
        let rest = &self.text[self.at..];
        if let Some((name, _)) = rest.strip_prefix('[').and_then(|r| r.split_once(']')) {
            self.at += name.len() + 2;
            return Ok(Formula::Name(name.to_owned()));
        }
        let named = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
        let name = rest.split(|c| !named(c)).next().unwrap_or("");
        if name.is_empty() {
            return Err(self.fault("a number, a name or `(`"));
        }
        let name = name.to_owned();
        self.at += name.len();
        if !self.takes("(") {
            return Ok(Formula::Name(name));
        }
        let mut arguments = Vec::new();
        while !self.takes(")") {
            if !arguments.is_empty() && !self.takes(",") {
                return Err(self.fault("`,` or `)`"));
            }
            arguments.push(self.level(0)?);
        }
        call(name, arguments)
    }

    fn digits(&mut self) -> Result<Formula, CaseError> {
        let rest = &self.text.as_bytes()[self.at..];
        let part = |k: usize| {
            let exponent = k > 0 && matches!(rest[k - 1], b'e' | b'E');
            rest[k].is_ascii_digit()
                || matches!(rest[k], b'.' | b'e' | b'E')
                || (exponent && matches!(rest[k], b'-' | b'+'))
        };
        let length = (0..rest.len()).find(|k| !part(*k)).unwrap_or(rest.len());
        let number = self.text[self.at..self.at + length].parse();
        let number = number.map_err(|_| self.fault("a number"))?;
        self.at += length;
        Ok(Formula::Number(number))
    }
}

/// A call of a function that there is, with as many arguments as it takes.
fn call(name: String, arguments: Vec<Formula>) -> Result<Formula, CaseError> {
    let series = OF_SERIES.iter().find(|(known, _)| *known == name);
    let exact = plain(&name).map(|(_, count, _)| *count);
    let counts = match exact.or(series.map(|(_, count)| *count)) {
        Some(count) => count..=count,
        None if REDUCERS.iter().any(|(known, _)| *known == name) => 1..=2,
        None => return Err(CaseError::unknown("function", &name, known())),
    };
    if counts.contains(&arguments.len()) {
        Ok(Formula::Call(name, arguments))
    } else {
        Err(CaseError::Arguments {
            function: name,
            count: *counts.end(),
            found: arguments.len(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Result<f64, CaseError> {
        let mut values = Values::default();
        values.set("x", 3.0);
        values.known.insert("z".to_owned(), vec![1.0, 4.0, 2.0]);
        values.starts.insert("z".to_owned(), vec![7.0]);
        number(text, &values)
    }

    #[test]
    fn operators_bind_as_on_paper() {
        let expected = [
            ("1 + 2 * 3 ^ 2", 19.0),
            ("-x ^ 2", -9.0),
            ("2 ^ -1", 0.5),
            ("8 / 2 / 2 - 1", 1.0),
            ("1e-3 * 2.5E+3", 2.5),
            ("x > 2 and not(x == 3) or x <= 3", 1.0),
            ("if(x < 3, 1, hypot(3, 4))", 5.0),
            ("(1 + x) * 2", 8.0),
        ];
        for (text, exact) in expected {
            assert_eq!(value(text), Ok(exact), "{text}");
        }
    }

    #[test]
    fn series_are_reduced_where_a_condition_holds() {
        let expected = [
            ("last(z)", 2.0),
            ("largest(z * x, z < 3)", 6.0),
            ("first(z, since(z > 3))", 4.0),
            ("total(z, since(z > 3))", 6.0),
            ("last(z) - start(z)", -5.0),
            ("total(before(z + 1))", 15.0),
            ("largest(running(z, 2))", 3.0),
            ("last(cumulated(z))", 7.0),
            ("first(before(cumulated(z)))", 0.0),
            ("total(z, z > 9)", 0.0),
            ("1 or 0 / 0", 1.0),
            ("0 and 0 / 0", 0.0),
        ];
        for (text, exact) in expected {
            assert_eq!(value(text), Ok(exact), "{text}");
        }
    }

    #[test]
    fn nothing_and_no_number_come_to_no_number() {
        for text in [
            "largest(z, z > 9)",
            "smallest(z, z > 9)",
            "largest(z, z / 0 - z / 0 > 1)",
            "smallest(z * 0 / 0)",
            "min(0 / 0, 1)",
            "min(1, 0 / 0)",
            "0 / 0 == 1",
            "not(0 / 0 > 1)",
            "if(0 / 0, 1, 1)",
            "0 or 0 / 0",
            "1 and 0 / 0",
            "column_weight(0)",
            "links_x(3, 1e5, 0, 99)",
            "rods_in_bending(0, 0, 1)",
            "payload_masses(0, 1)",
            "uneven(4, 1, 0.5, 99)",
            "hoisted_growth(0)",
            "drawn(1, 1e12)",
            "drawn_below(1, 1, 0)",
        ] {
            assert!(value(text).unwrap().is_nan(), "{text}");
        }
    }

    #[test]
    fn faults_name_their_place_and_what_is_near() {
        let fault = |text: &str| value(text).unwrap_err().to_string();
        let expected = "`larges(z)`: no function is called `larges`: perhaps `largest`";
        assert_eq!(fault("larges(z)"), expected);
        assert_eq!(fault("2 * y"), "`2 * y`: no value is called `y`");
        assert_eq!(fault("(2"), "`(2`: `)` is missing before ``");
        let found = fault("hypot(1)");
        assert_eq!(found, "`hypot(1)`: `hypot` takes 2 arguments, not 1");
        assert!(fault("z + 1").contains("reduce it"), "{}", fault("z + 1"));
        let deep = fault(&"(".repeat(20_000));
        assert!(deep.contains("nested"), "{}", &deep[deep.len() - 100..]);
    }
}
