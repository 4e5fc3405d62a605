//! How a series looks: a colour, and a form of its own, which is the shape of its points and the dashes of its line.
//!
//! A solver has the colour of its library everywhere: one of Okabe and Ito's or near it, darkened until its lines can be
//! seen on white, grey or black. What tells its variants apart is the form, and so it is for two libraries whose colours
//! are near each other for a reader without green cones. What is no solver has other colours, and the forms in
//! turn: it shares no plot with solvers. All can be read on white and on a dark page, where black is the page's ink.

use serde::{Deserialize, Serialize};
use taut_solver::Backend;

/// Marker of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum Shape {
    /// A dot; a ring where it is hollow.
    #[default]
    Circle,
    Triangle,
    Square,
    /// A square on its corner.
    Diamond,
    /// Two lines across each other: ×, or + for the hollow one.
    Cross,
}

/// Pattern of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum Dash {
    /// Without gaps.
    #[default]
    Solid,
    Dashed,
    Dotted,
    /// Dashes and dots in turn.
    DashDotted,
    /// A dash and two dots in turn.
    DashDotDotted,
    /// Long dashes.
    Long,
    /// Dots far from each other.
    Sparse,
}

impl Dash {
    pub(super) const ALL: [Self; 7] = [
        Self::Solid,
        Self::Dashed,
        Self::Dotted,
        Self::DashDotted,
        Self::DashDotDotted,
        Self::Long,
        Self::Sparse,
    ];

    /// Lengths of strokes and gaps \[pixels], as SVG takes them; nothing for a line without gaps.
    pub(super) fn lengths(self) -> &'static str {
        match self {
            Self::Solid => "",
            Self::Dashed => "9 5",
            Self::Dotted => "2 4",
            Self::DashDotted => "10 4 2 4",
            Self::DashDotDotted => "10 4 2 4 2 4",
            Self::Long => "18 6",
            Self::Sparse => "3 9",
        }
    }
}

/// How a series looks, whatever its place among the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Look {
    /// Red, green and blue.
    pub colour: [u8; 3],
    pub shape: Shape,
    /// Draws the markers as outlines.
    pub hollow: bool,
    pub dash: Dash,
}

/// Colours of series that are not solvers: a violet, an olive, a crimson.
const COLOURS: [[u8; 3]; 3] = [[112, 100, 190], [140, 140, 30], [190, 70, 100]];

/// Forms in turn. Their number has no factor in common with that of the colours: all pairs come before one comes again.
const FORMS: [(Shape, Dash); 5] = [
    (Shape::Circle, Dash::Solid),
    (Shape::Triangle, Dash::Dashed),
    (Shape::Square, Dash::Dotted),
    (Shape::Diamond, Dash::DashDotted),
    (Shape::Cross, Dash::Long),
];

impl Look {
    /// Look of the series at `place` among those that are not solvers. Colours and forms rotate;
    /// every second round has hollow markers.
    pub fn by_place(place: usize) -> Self {
        let (shape, dash) = FORMS[place % FORMS.len()];
        Self {
            colour: COLOURS[place % COLOURS.len()],
            shape,
            hollow: place / (FORMS.len() * COLOURS.len()) % 2 == 1,
            dash,
        }
    }

    /// Look of a solver by its command-line name, with `lapack`; `None` for other names.
    pub fn of_solver(name: &str) -> Option<Self> {
        let mut words = name.split([':', '/', ' ', '+']);
        let library = words.next().unwrap_or_default();
        let mut entries = Backend::all().into_iter().map(|backend| backend.entry());
        let entry = entries.find(|entry| entry.name == library);
        let colour = match (entry, library) {
            (Some(entry), _) => entry.colour,
            (None, "lapack") => [0, 0, 0],
            _ => return None,
        };
        // Variants whose words are not known take the forms in turn.
        let rows = entry.map_or(&[][..], |entry| entry.rows).iter();
        let schur = name.strip_suffix("/kkt").unwrap_or(name);
        let place = rows
            .filter(|row| !row.ends_with("/kkt"))
            .position(|row| *row == schur);
        let variant = |word: &str| match word {
            "ldlt" | "jacobi" | "groups" | "refine" | "upper" | "extended" => Some(Shape::Triangle),
            "lu" | "group" | "minimum-degree" => Some(Shape::Square),
            "refinement=0" => Some(Shape::Diamond),
            "lblt" | "none" | "scene" | "many" => Some(Shape::Cross),
            _ => None,
        };
        let own = match library {
            "nalgebra-sparse" | "dense" => Shape::Diamond,
            _ => FORMS[place.unwrap_or_default() % FORMS.len()].0,
        };
        let shape = words.clone().find_map(variant).unwrap_or(own);
        // On the KKT matrix.
        let hollow = words.any(|word| word == "kkt");
        Some(Self {
            colour,
            shape,
            hollow,
            dash: dash(shape, hollow),
        })
    }
}

/// The dashes of a solver's variant: no two of a library that are drawn together have the same.
fn dash(shape: Shape, hollow: bool) -> Dash {
    match (shape, hollow) {
        (Shape::Circle, false) => Dash::Solid,
        (Shape::Circle, true) | (Shape::Triangle, false) => Dash::Dashed,
        (Shape::Diamond, false) | (Shape::Cross, true) => Dash::DashDotted,
        (Shape::Triangle, true) => Dash::DashDotDotted,
        (Shape::Square, false) | (Shape::Diamond, true) => Dash::Dotted,
        (Shape::Square, true) => Dash::Long,
        (Shape::Cross, false) => Dash::Sparse,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;
    use taut_measure::choice::Choice;
    use taut_solver::Entry;

    /// Relative luminance of a colour, as the Web Content Accessibility Guidelines have it.
    fn luminance(colour: [u8; 3]) -> f64 {
        let linear = |c: u8| {
            let c = f64::from(c) / 255.0;
            if c <= 0.04045 {
                c / 12.92
            } else {
                ((c + 0.055) / 1.055).powf(2.4)
            }
        };
        let [r, g, b] = colour.map(linear);
        0.2126 * r + 0.7152 * g + 0.0722 * b
    }

    fn contrast(a: [u8; 3], b: [u8; 3]) -> f64 {
        let [a, b] = [a, b].map(luminance);
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    /// Colour as seen without green cones (Viénot, Brettel, Mollon 1999), in CIE L*a*b*.
    fn seen(colour: [u8; 3]) -> [f64; 3] {
        let alone = |i: usize| {
            let mut only = [0; 3];
            only[i] = colour[i];
            luminance(only) / [0.2126, 0.7152, 0.0722][i]
        };
        let [r, g, b] = [0, 1, 2].map(alone);
        let yellow = 0.29275 * r + 0.70725 * g;
        let blue = (b + 0.02234 * (g - r)).max(0.0);
        let f = |t: f64| {
            if t > 0.008_856 {
                t.cbrt()
            } else {
                7.787 * t + 16.0 / 116.0
            }
        };
        let x = f((0.7700 * yellow + 0.1805 * blue) / 0.9505);
        let y = f(0.9278 * yellow + 0.0722 * blue);
        let z = f((0.1385 * yellow + 0.9505 * blue) / 1.0890);
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    fn distance(a: [u8; 3], b: [u8; 3]) -> f64 {
        let both = seen(a).into_iter().zip(seen(b));
        both.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    }

    #[test]
    fn variants_of_a_solver_have_one_colour_and_forms_of_their_own() {
        let choices = Choice::all().into_iter();
        let mut names: Vec<String> = choices.map(|choice| choice.family()).collect();
        names.sort();
        names.dedup();
        names.extend(["umfpack", "lapack:lower", "lapack:upper"].map(str::to_owned));
        names.extend(["faer:lblt", "faer:lblt/kkt", "banded+many"].map(str::to_owned));
        let looks: Vec<Look> = names
            .iter()
            .map(|name| Look::of_solver(name).expect("a solver"))
            .collect();
        for (i, (look, name)) in looks.iter().zip(&names).enumerate() {
            for (other, others_name) in looks[..i].iter().zip(&names) {
                let same_shape = (look.shape, look.hollow) == (other.shape, other.hollow);
                let same_dash = look.dash == other.dash;
                let same_library = look.colour == other.colour;
                let both = format!("{name} and {others_name}");
                assert!(!(same_library && (same_shape || same_dash)), "{both}");
                // Solvers of two libraries must differ in colour or form, not in both.
                let near = distance(look.colour, other.colour) < NEAR;
                assert!(!(near && same_shape && same_dash), "{both}");
            }
        }
        assert_eq!(Look::of_solver("third-difference"), None);
    }

    /// Colours that are less apart than this are taken for each other in thin lines.
    const NEAR: f64 = 15.0;

    #[test]
    fn colours_of_solvers_are_read_on_light_and_dark() {
        let listed = Backend::all().into_iter().map(|backend| backend.entry());
        for entry in listed.chain([Entry::new("of-another-crate")]) {
            for page in [[255; 3], [0x16; 3]] {
                let contrast = contrast(entry.colour, page);
                assert!(contrast > 3.0, "{}: {contrast}", entry.name);
            }
        }
    }

    #[test]
    fn what_is_no_solver_has_other_colours_that_are_read_on_light_and_dark() {
        let of_solver = |name: &Choice| Look::of_solver(name.backend.name()).map(|l| l.colour);
        let solvers: HashSet<_> = Choice::all().iter().filter_map(of_solver).collect();
        for colour in COLOURS {
            assert!(!solvers.contains(&colour));
            for page in [[255; 3], [0x16; 3]] {
                let contrast = contrast(colour, page);
                assert!(contrast > 3.0, "{colour:?}: {contrast}");
            }
        }
        let looks: HashSet<Look> = (0..30).map(Look::by_place).collect();
        assert_eq!(looks.len(), 30);
        let lines = (0..15).map(Look::by_place);
        let lines: HashSet<_> = lines.map(|l| (l.colour, l.dash)).collect();
        assert_eq!(lines.len(), 15);
    }
}
