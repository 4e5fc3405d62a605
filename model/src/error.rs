//! Errors of scenes: the fault, its place and its cure.

/// An enumeration whose variants have their text beside them: what `write!` takes, with the fields by name. A field whose name
/// says all has no documentation.
macro_rules! messages {
    (
        $(#[$attribute:meta])*
        pub enum $name:ident {
            $(
                $(#[doc = $doc:literal])*
                $variant:ident $({
                    $($(#[doc = $field_doc:literal])* $field:ident: $type:ty,)*
                })? => $text:literal $(, $argument:expr)*;
            )*
        }
    ) => {
        $(#[$attribute])*
        #[allow(missing_docs)]
        pub enum $name {
            $(
                $(#[doc = $doc])*
                $variant $({
                    $($(#[doc = $field_doc])* $field: $type,)*
                })?,
            )*
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                match self {
                    $(Self::$variant $({ $($field),* })? => write!(f, $text $(, $argument)*),)*
                }
            }
        }
    };
}

messages! {
    /// Why a scene cannot be built or read. Its `Display` is one line.
    #[derive(Debug, Clone, PartialEq)]
    #[non_exhaustive]
    pub enum SceneError {
        /// No scene has this name.
        UnknownScene {
            name: String,
            /// All names that there are.
            known: Vec<String>,
        } => "no scene is called `{name}`: choose one of {}, or give a TOML file", known.join(", ");
        /// A parameter has a name that is not one of its values.
        UnknownName {
            /// The parameter's key.
            what: &'static str,
            name: String,
            /// All names that it can have.
            known: Vec<String>,
        } => "{what} `{name}` is not known: {}", one_of(known);
        /// A number is out of range, NaN or infinite.
        BadValue {
            /// Whose number: a parameter's key, or body or joint and quantity.
            what: String,
            /// The number.
            value: f64,
            /// Allowed values, with their unit.
            needs: &'static str,
        } => "{what} is {value}: it has to be {needs}";
        /// A count beyond what can be built.
        TooLarge {
            /// The parameter's key.
            what: &'static str,
            value: usize,
            /// The largest value allowed.
            limit: usize,
        } => "{what} is {value}: at most {limit} can be built";
        /// Two parameters exclude each other, or one needs another.
        Conflict {
            /// The parameter's key or the joint.
            what: String,
            /// Why it does not go, and what to do.
            reason: &'static str,
        } => "{what}: {reason}";
        /// Two bodies or two joints have the same name.
        Duplicate {
            /// `body` or `joint`.
            kind: &'static str,
            name: String,
        } => "two {kind} entries are called `{name}`: rename one";
        /// A joint, `load` or a program names a body that is not there.
        UnknownBody {
            /// Who names it.
            what: String,
            name: String,
            /// Names of the bodies that there are (the first few).
            known: Vec<String>,
        } => "{what} names the body `{name}`, which is not there: {}", one_of(known);
        /// A control or a program names a joint or cable that is not there.
        UnknownJoint {
            /// Who names it.
            what: String,
            name: String,
            /// Names of those that it could be (the first few).
            known: Vec<String>,
        } => "{what} names `{name}`, which is not there{}", or_no_other(known);
        /// A program or a table names a control that is not there.
        UnknownControl {
            name: String,
            /// Names of the controls that there are (the first few).
            known: Vec<String>,
        } => "no control is called `{name}`: {}", or_none(known);
        /// No side of a joint is a body that forces move.
        BothWorld {
            joint: String,
        } => "joint `{joint}` ties the world to the world: make one side a dynamic body";
        /// Both sides of a joint are the same body.
        SameBody {
            joint: String,
            body: String,
        } => "joint `{joint}` ties body `{body}` to itself: make one side another body";
        /// An inertia is not symmetric positive definite.
        Inertia {
            body: String,
        } =>
                "the inertia of body `{body}` is not symmetric positive definite: give positive principal moments [kg m²]";
        /// The axes of a frame are not orthonormal and right-handed.
        Axes {
            joint: String,
            /// `a` or `b`.
            side: String,
            /// Largest entry of |AᵀA − I| (or of the determinant's error).
            error: f64,
        } =>
                "the axes of side {side} of joint `{joint}` are off by {error:.1e} from orthonormal and right-handed: give \
                 unit columns u, v and w = u × v";
        /// An array of the scene has the wrong length.
        Length {
            /// Which array.
            what: &'static str,
            /// Its length.
            got: usize,
            /// The length it has to have.
            expected: usize,
        } => "{what} has length {got}: it has to be {expected}";
        /// The text is not TOML, or not the TOML of a scene.
        Toml {
            /// Line and column from 1, when known.
            place: Option<(usize, usize)>,
            /// Message of the reader.
            message: String,
        } => "{}{message}", at(*place);
        /// A fault of a scene that was read, with its place in the text.
        InText {
            /// Line from 1.
            line: usize,
            /// Column from 1, in characters.
            column: usize,
            /// The key at fault.
            key: String,
            fault: Box<SceneError>,
        } => "line {line}, column {column}: {}", naming(fault.to_string(), key);
        /// An override `KEY=VALUE` does not fit.
        Override {
            key: String,
            /// The fault.
            message: String,
        } => "override `{key}`: {message}";
    }
}

impl std::error::Error for SceneError {}

fn one_of(known: &[String]) -> String {
    format!("choose one of {}", known.join(", "))
}

fn or_none(known: &[String]) -> String {
    match known {
        [] => "the scene has none".to_owned(),
        known => one_of(known),
    }
}

fn or_no_other(known: &[String]) -> String {
    match known {
        [] => ", nor is another: a control needs a joint that has a motor with a speed, or a cable that has a winch".to_owned(),
        known => format!(": {}", one_of(known)),
    }
}

/// The place of a message, before it.
fn at(place: Option<(usize, usize)>) -> String {
    let prefix = place.map(|(line, column)| format!("line {line}, column {column}: "));
    prefix.unwrap_or_default()
}

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

/// Refuses what does not go, with its cure.
pub(crate) fn refuse<T>(what: impl Into<String>, reason: &'static str) -> Result<T, SceneError> {
    let what = what.into();
    Err(SceneError::Conflict { what, reason })
}

/// Refuses a number that is not finite or not `ok`.
pub(crate) fn check(
    what: impl Into<String>,
    value: f64,
    ok: bool,
    needs: &'static str,
) -> Result<(), SceneError> {
    if ok && value.is_finite() {
        return Ok(());
    }
    Err(SceneError::BadValue {
        what: what.into(),
        value,
        needs,
    })
}

/// Refuses an array of another length than expected.
pub(crate) fn check_length(
    what: &'static str,
    got: usize,
    expected: usize,
) -> Result<(), SceneError> {
    if got == expected {
        return Ok(());
    }
    Err(SceneError::Length {
        what,
        got,
        expected,
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
    check(what, value, false, needs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_one_line_and_say_what_to_do() {
        let all = [
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
                place: Some((3, 7)),
                message: "expected `=`".into(),
            },
        ];
        let text: Vec<_> = all.iter().map(ToString::to_string).collect();
        assert!(text.iter().all(|t| !t.contains('\n')));
        assert_eq!(text[0], "body `hook`: mass is -1: it has to be > 0 kg");
        assert_eq!(text[3], "line 3, column 7: expected `=`");
    }

    #[test]
    fn check_refuses_what_is_not_finite() {
        assert!(check("x", f64::NAN, true, "finite").is_err());
        assert!(check("x", f64::INFINITY, true, "finite").is_err());
        assert_eq!(check("x", 2.0, true, "finite"), Ok(()));
    }
}
