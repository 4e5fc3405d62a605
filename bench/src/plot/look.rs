//! How a series looks: a colour, and a form of its own, which is the shape of its points and the dashes of its line.
//!
//! A solver has the colour of its library everywhere, one of Okabe and Ito's, grey or black; what tells its variants
//! apart is the form. What is no solver has other colours, three that colour-blind readers take for a blue, a yellow
//! and a grey, and the forms in turn. All can be read on white and on a dark page.

/// What a point is drawn as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Shape {
    /// A dot; a ring where it is hollow.
    #[default]
    Circle,
    /// A triangle.
    Triangle,
    /// A square.
    Square,
    /// A square on its corner.
    Diamond,
    /// Two lines across each other: ×, or + for the hollow one.
    Cross,
}

/// What a line is drawn as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Dash {
    /// Without gaps.
    #[default]
    Solid,
    /// Dashes.
    Dashed,
    /// Dots.
    Dotted,
    /// Dashes and dots in turn.
    DashDotted,
    /// Long dashes.
    Long,
    /// Dots far from each other.
    Sparse,
}

impl Dash {
    /// All of them.
    pub(super) const ALL: [Self; 6] = [
        Self::Solid,
        Self::Dashed,
        Self::Dotted,
        Self::DashDotted,
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
            Self::Long => "18 6",
            Self::Sparse => "3 9",
        }
    }
}

/// How a series looks, whatever its place among the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Look {
    /// Red, green and blue.
    pub colour: [u8; 3],
    /// What its points are.
    pub shape: Shape,
    /// Whether these are outlines.
    pub hollow: bool,
    /// What its lines are.
    pub dash: Dash,
}

/// Colours of what is no solver: a violet, an olive, a crimson.
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
    /// Of the series at that place among others that are no solvers: colours and forms in turn, hollow ones in every
    /// second round.
    #[must_use]
    pub fn by_place(place: usize) -> Self {
        let (shape, dash) = FORMS[place % FORMS.len()];
        Self {
            colour: COLOURS[place % COLOURS.len()],
            shape,
            hollow: place / (FORMS.len() * COLOURS.len()) % 2 == 1,
            dash,
        }
    }

    /// Of a solver, by its name as the command line has it; nothing for what is none.
    #[must_use]
    pub fn of_solver(name: &str) -> Option<Self> {
        let mut words = name.split([':', '/', ' ', '+']);
        let library = words.next().unwrap_or_default();
        let colour = match library {
            "banded" | "batch" => [0, 114, 178],
            "faer" => [0, 158, 115],
            "nalgebra-sparse" => [86, 180, 233],
            "umfpack" => [213, 94, 0],
            "gauss-seidel" => [230, 159, 0],
            "cg" => [204, 121, 167],
            "dense" => [128, 128, 128],
            "lapack" => [0, 0, 0],
            _ => return None,
        };
        let variant = |word: &str| match word {
            "ldlt" | "jacobi" | "groups" | "refine" | "upper" | "border" | "extended" => {
                Some(Shape::Triangle)
            }
            "lu" | "group" | "minimum-degree" => Some(Shape::Square),
            "refinement=0" => Some(Shape::Diamond),
            "none" | "scene" => Some(Shape::Cross),
            _ => None,
        };
        let own = if library == "batch" {
            Shape::Square
        } else {
            Shape::Circle
        };
        let shape = words.clone().find_map(variant).unwrap_or(own);
        // Those that do not form S.
        let hollow = words.any(|word| ["kkt", "matrix-free"].contains(&word));
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
        (Shape::Circle, false) | (Shape::Cross, true) => Dash::Solid,
        (Shape::Circle, true) | (Shape::Triangle, false) => Dash::Dashed,
        (Shape::Triangle, true) | (Shape::Diamond, false) => Dash::DashDotted,
        (Shape::Square, false) | (Shape::Diamond, true) => Dash::Dotted,
        (Shape::Square, true) => Dash::Long,
        (Shape::Cross, false) => Dash::Sparse,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::choice::Choice;
    use std::collections::HashSet;

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

    #[test]
    fn variants_of_a_solver_have_one_colour_and_forms_of_their_own() {
        let choices = Choice::all().into_iter().chain(crate::iterative::choices());
        let mut names: Vec<String> = choices.map(|choice| choice.family()).collect();
        names.sort();
        names.dedup();
        names.extend(["umfpack", "batch", "lapack:lower", "lapack:upper"].map(str::to_owned));
        let looks: Vec<Look> = names
            .iter()
            .map(|name| Look::of_solver(name).expect("a solver"))
            .collect();
        for (i, (look, name)) in looks.iter().zip(&names).enumerate() {
            for (other, others_name) in looks[..i].iter().zip(&names) {
                let same_library = look.colour == other.colour;
                let alike = (look.shape, look.hollow) == (other.shape, other.hollow)
                    || look.dash == other.dash;
                assert!(!(same_library && alike), "{name} and {others_name}");
            }
        }
        assert_eq!(Look::of_solver("third-difference"), None);
    }

    #[test]
    fn what_is_no_solver_has_other_colours_that_are_read_on_light_and_dark() {
        let of_solver = |name: &Choice| Look::of_solver(name.backend.name()).map(|l| l.colour);
        let solvers: HashSet<_> = Choice::all().iter().filter_map(of_solver).collect();
        for colour in COLOURS {
            assert!(!solvers.contains(&colour));
            for page in [[255; 3], [0x16; 3]].map(luminance) {
                let own = luminance(colour);
                let contrast = (own.max(page) + 0.05) / (own.min(page) + 0.05);
                assert!(contrast > 3.0, "{colour:?}: {contrast}");
            }
        }
        let looks: HashSet<Look> = (0..30).map(Look::by_place).collect();
        assert_eq!(looks.len(), 30);
        let lines: HashSet<_> = (0..15)
            .map(Look::by_place)
            .map(|l| (l.colour, l.dash))
            .collect();
        assert_eq!(lines.len(), 15);
    }
}
