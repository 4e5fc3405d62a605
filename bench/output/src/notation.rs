//! How numbers are written for people: 10³ in prose, headings, ticks and legends, plain numbers in the cells of tables.

/// Three digits; powers of ten from 10³ on and below 10⁻² are written as such, what is larger than 10⁵ or smaller than
/// 10⁻³ with one.
pub fn number(value: f64) -> String {
    let size = value.abs();
    if size < 1e-300 {
        return "0".to_owned();
    }
    let log = size.log10();
    let is_power = (log - log.round()).abs() <= 1e-9;
    let is_near_one = (-2.5..2.5).contains(&log);
    if (1e-3..1e5).contains(&size) && (is_near_one || !is_power) {
        let digits = (2 - log.floor() as i32).clamp(0, 5) as usize;
        return without_zeros(format!("{value:.digits$}"));
    }
    scientific(value)
}

/// Two digits times a power of ten.
fn scientific(value: f64) -> String {
    let text = format!("{value:.1e}");
    let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let power = power_of_ten(exponent);
    match digits.trim_end_matches(".0") {
        "1" => power,
        "-1" => format!("-{power}"),
        digits => format!("{digits}·{power}"),
    }
}

/// A tick of a logarithmic axis: with a power of ten from 10³ on and below 10⁻².
pub(crate) fn on_log_axis(value: f64) -> String {
    // A little wider, for what rounding makes of 0.01.
    if (0.99e-2..0.99e3).contains(&value) {
        number(value)
    } else {
        scientific(value)
    }
}

/// 10 with a raised exponent.
fn power_of_ten(exponent: &str) -> String {
    let raised = exponent.chars().map(|c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32('⁰' as u32 + digit as u32 - '0' as u32).unwrap_or(digit),
    });
    "10".chars().chain(raised).collect()
}

/// Four digits in a cell, with an exponent where the number is large or small.
pub(crate) fn plain(number: f64) -> String {
    let size = number.abs();
    if size == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e5).contains(&size) {
        let digits = (3 - size.log10().floor() as i32).clamp(0, 6) as usize;
        without_zeros(format!("{number:.digits$}"))
    } else {
        format!("{number:.1e}").replace(".0e", "e")
    }
}

/// A decimal number without the zeros at its end.
fn without_zeros(text: String) -> String {
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_powers_are_short() {
        assert_eq!(
            [
                0.0, 1.0, 0.25, 100.0, 1000.0, 1234.0, 1e7, -2.5e-9, 0.01, 1e-3
            ]
            .map(number),
            [
                "0",
                "1",
                "0.25",
                "100",
                "10³",
                "1234",
                "10⁷",
                "-2.5·10⁻⁹",
                "0.01",
                "10⁻³"
            ]
        );
        let found = [5e3, 0.01, 5e-3].map(on_log_axis);
        assert_eq!(found, ["5·10³", "0.01", "5·10⁻³"]);
        assert_eq!([2e7, 9.99e5].map(number), ["2·10⁷", "10⁶"]);
        assert_eq!(["-12", "0", "3"].map(power_of_ten), ["10⁻¹²", "10⁰", "10³"]);
    }

    #[test]
    fn numbers_in_cells_are_plain() {
        let shown = [0.0, 0.016_666_666, 1234.567, 12_345.6, 1e7, -2.5e-9].map(plain);
        assert_eq!(shown, ["0", "0.01667", "1235", "12346", "1e7", "-2.5e-9"]);
    }
}
