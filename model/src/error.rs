//! Errors of scenes: the fault, its place and its cure.

use std::fmt;

/// Why a scene cannot be built or read. Its `Display` is one line.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum SceneError {
    /// The scene has no bodies.
    Empty,
    /// No scene has this name.
    UnknownScene {
        /// The name asked for.
        name: String,
        /// All names that there are.
        known: Vec<String>,
    },
    /// A parameter has a name that is not one of its values.
    UnknownName {
        /// The parameter's key.
        what: &'static str,
        /// The name given.
        name: String,
        /// All names that it can have.
        known: Vec<String>,
    },
    /// A number is out of range, NaN or infinite.
    BadValue {
        /// Whose number: a parameter's key, or body or joint and quantity.
        what: String,
        /// The number.
        value: f64,
        /// Allowed values, with their unit.
        needs: &'static str,
    },
    /// A count beyond what can be built.
    TooLarge {
        /// The parameter's key.
        what: &'static str,
        /// Its value.
        value: usize,
        /// The largest value allowed.
        limit: usize,
    },
    /// Two parameters exclude each other, or one needs another.
    Conflict {
        /// The parameter's key or the joint.
        what: String,
        /// Why it does not go, and what to do.
        reason: &'static str,
    },
    /// Two bodies or two joints have the same name.
    Duplicate {
        /// `body` or `joint`.
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// A joint, `load` or a program names a body that is not there.
    UnknownBody {
        /// Who names it.
        what: String,
        /// The name or index.
        name: String,
        /// Names of the bodies that there are (the first few).
        known: Vec<String>,
    },
    /// A massless cable is far shorter than its path at the start.
    Short {
        /// The cable.
        cable: String,
        /// Its length at rest \[m].
        length: f64,
        /// The length of its path, with what lies on sheaves and drums \[m].
        path: f64,
        /// Its strain, of what is off the drums.
        strain: f64,
    },
    /// A control or a program names a joint or cable that is not there.
    UnknownJoint {
        /// Who names it.
        what: String,
        /// The name.
        name: String,
        /// Names of those that it could be (the first few).
        known: Vec<String>,
    },
    /// A program or a table names a control that is not there.
    UnknownControl {
        /// The name.
        name: String,
        /// Names of the controls that there are (the first few).
        known: Vec<String>,
    },
    /// No side of a joint is a body that forces move.
    BothWorld {
        /// The joint.
        joint: String,
    },
    /// Both sides of a joint are the same body.
    SameBody {
        /// The joint.
        joint: String,
        /// The body.
        body: String,
    },
    /// A body is to be removed that a joint holds.
    Held {
        /// The body.
        body: String,
        /// The joint.
        joint: String,
    },
    /// A joint has no rows.
    NoRows {
        /// The joint.
        joint: String,
    },
    /// An inertia is not symmetric positive definite.
    Inertia {
        /// The body.
        body: String,
    },
    /// The axes of a frame are not orthonormal and right-handed.
    Axes {
        /// The joint.
        joint: String,
        /// `a` or `b`.
        side: String,
        /// Largest entry of |AᵀA − I| (or of the determinant's error).
        error: f64,
    },
    /// An array of the scene has the wrong length.
    Length {
        /// Which array.
        what: &'static str,
        /// Its length.
        got: usize,
        /// The length it has to have.
        expected: usize,
    },
    /// The text is not TOML, or not the TOML of a scene.
    Toml {
        /// Line from 1, when known.
        line: Option<usize>,
        /// Column from 1, when known.
        column: Option<usize>,
        /// Message of the reader.
        message: String,
    },
    /// A fault of a scene that was read, with its place in the text.
    InText {
        /// Line from 1.
        line: usize,
        /// Column from 1, in characters.
        column: usize,
        /// The key at fault.
        key: String,
        /// The fault.
        fault: Box<SceneError>,
    },
    /// A scene holds something that no text can hold.
    NotInText {
        /// Name of that part of the scene.
        what: String,
        /// The cure.
        cure: &'static str,
    },
    /// An override `KEY=VALUE` does not fit.
    Override {
        /// The key.
        key: String,
        /// The fault.
        message: String,
    },
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "the scene has no bodies: give it at least one [[body]]"),
            Self::UnknownScene { name, known } => {
                let known = known.join(", ");
                write!(
                    f,
                    "no scene is called `{name}`: choose one of {known}, or give a TOML file"
                )
            }
            Self::UnknownName { what, name, known } => {
                let known = known.join(", ");
                write!(f, "{what} `{name}` is not known: choose one of {known}")
            }
            Self::BadValue { what, value, needs } => {
                write!(f, "{what} is {value}: it has to be {needs}")
            }
            Self::TooLarge { what, value, limit } => {
                write!(f, "{what} is {value}: at most {limit} can be built")
            }
            Self::Conflict { what, reason } => write!(f, "{what}: {reason}"),
            Self::Duplicate { kind, name } => {
                write!(f, "two {kind} entries are called `{name}`: rename one")
            }
            Self::UnknownBody { what, name, known } => {
                let known = known.join(", ");
                write!(
                    f,
                    "{what} names the body `{name}`, which is not there: choose one of {known}"
                )
            }
            Self::Length {
                what,
                got,
                expected,
            } => {
                write!(f, "{what} has length {got}: it has to be {expected}")
            }
            Self::Toml {
                line,
                column,
                message,
            } => match (line, column) {
                (Some(line), Some(column)) => write!(f, "line {line}, column {column}: {message}"),
                _ => write!(f, "{message}"),
            },
            Self::InText {
                line,
                column,
                key,
                fault,
            } => {
                let fault = naming(fault.to_string(), key);
                write!(f, "line {line}, column {column}: {fault}")
            }
            Self::NotInText { what, cure } => {
                write!(f, "a text cannot hold {what}: {cure}")
            }
            Self::Override { key, message } => write!(f, "override `{key}`: {message}"),
            _ => self.fmt_structure(f),
        }
    }
}

impl SceneError {
    /// The faults of bodies and joints as they stand in a scene.
    fn fmt_structure(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Short {
                cable,
                length,
                path,
                strain,
            } => write!(
                f,
                "massless cable `{cable}`: length is {length} m, but its path is {path:.6} m long, a strain of {:.3} % at the \
                 start: leave `length` out for the length of the path, give `slack` (m) or a smaller `tension` (N), or `strained = true` where it is meant so",
                100.0 * strain
            ),
            Self::UnknownJoint { what, name, known } if known.is_empty() => write!(
                f,
                "{what} names `{name}`, which is not there, nor is another: a control needs a joint that has a motor with a \
                 speed, or a cable that has a winch"
            ),
            Self::UnknownJoint { what, name, known } => {
                let known = known.join(", ");
                write!(
                    f,
                    "{what} names `{name}`, which is not there: choose one of {known}"
                )
            }
            Self::Held { body, joint } => write!(
                f,
                "body `{body}` cannot be removed while `{joint}` holds it: remove that as well"
            ),
            Self::UnknownControl { name, known } if known.is_empty() => {
                write!(f, "no control is called `{name}`: the scene has none")
            }
            Self::UnknownControl { name, known } => {
                let known = known.join(", ");
                write!(f, "no control is called `{name}`: choose one of {known}")
            }
            Self::BothWorld { joint } => {
                write!(
                    f,
                    "joint `{joint}` ties the world to the world: make one side a dynamic body"
                )
            }
            Self::SameBody { joint, body } => {
                write!(
                    f,
                    "joint `{joint}` ties body `{body}` to itself: make one side another body"
                )
            }
            Self::NoRows { joint } => write!(
                f,
                "joint `{joint}` has no rows: give it at least one of stretch, bend, twist"
            ),
            Self::Inertia { body } => write!(
                f,
                "the inertia of body `{body}` is not symmetric positive definite: give positive principal moments [kg m²]"
            ),
            Self::Axes { joint, side, error } => write!(
                f,
                "the axes of side {side} of joint `{joint}` are off by {error:.1e} from orthonormal and right-handed: give unit columns u, v and w = u × v"
            ),
            _ => Ok(()),
        }
    }
}

impl std::error::Error for SceneError {}

/// `message`, with `key` where it does not name it.
pub(crate) fn naming(message: String, key: &str) -> String {
    let word = |c: char| !(c.is_alphanumeric() || c == '_');
    // Names stand in backticks, too: only what is outside of them names the key.
    let outside = message.split('`').step_by(2).collect::<String>();
    if outside.split(word).any(|part| part == key) {
        message
    } else {
        format!("{message} (key `{key}`)")
    }
}

/// `value` if it is finite and `ok` holds, else the error that names it.
pub(crate) fn check(
    what: impl Into<String>,
    value: f64,
    ok: bool,
    needs: &'static str,
) -> Result<f64, SceneError> {
    if ok && value.is_finite() {
        return Ok(value);
    }
    Err(SceneError::BadValue {
        what: what.into(),
        value,
        needs,
    })
}

/// [`check`] for a number that may be infinite.
pub(crate) fn limited(
    what: String,
    value: f64,
    good: bool,
    needs: &'static str,
) -> Result<(), SceneError> {
    if good {
        return Ok(());
    }
    check(what, value, false, needs).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_one_line_and_say_what_to_do() {
        let all = [
            SceneError::Empty,
            check("body `hook`: mass", -1.0, false, "> 0 kg").expect_err("refused"),
            SceneError::Duplicate {
                kind: "body",
                name: "hook".into(),
            },
            SceneError::Axes {
                joint: "anchor".into(),
                side: "a".to_owned(),
                error: 0.5,
            },
            SceneError::Toml {
                line: Some(3),
                column: Some(7),
                message: "expected `=`".into(),
            },
        ];
        let text: Vec<_> = all.iter().map(ToString::to_string).collect();
        assert!(text.iter().all(|t| !t.contains('\n')));
        assert_eq!(text[1], "body `hook`: mass is -1: it has to be > 0 kg");
        assert_eq!(text[4], "line 3, column 7: expected `=`");
    }

    #[test]
    fn check_refuses_what_is_not_finite() {
        assert!(check("x", f64::NAN, true, "finite").is_err());
        assert!(check("x", f64::INFINITY, true, "finite").is_err());
        assert_eq!(check("x", 2.0, true, "finite"), Ok(2.0));
    }
}
