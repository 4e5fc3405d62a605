//! Errors of scenes: the fault, its place and its cure.

/// An enumeration whose variants have their text beside them: what `write!` takes, with the fields by name.
macro_rules! told {
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
pub(crate) use told;

told! {
    /// Why a scene cannot be built or read. Its `Display` is one line.
    #[derive(Debug, Clone, PartialEq)]
    #[non_exhaustive]
    pub enum SceneError {
        /// The scene has no bodies.
        Empty => "the scene has no bodies: give it at least one [[body]]";
        /// No scene has this name.
        UnknownScene {
            /// The name asked for.
            name: String,
            /// All names that there are.
            known: Vec<String>,
        } => "no scene is called `{name}`: choose one of {}, or give a TOML file", known.join(", ");
        /// A parameter has a name that is not one of its values.
        UnknownName {
            /// The parameter's key.
            what: &'static str,
            /// The name given.
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
            /// Its value.
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
            /// The name.
            name: String,
        } => "two {kind} entries are called `{name}`: rename one";
        /// A joint, `load` or a program names a body that is not there.
        UnknownBody {
            /// Who names it.
            what: String,
            /// The name or index.
            name: String,
            /// Names of the bodies that there are (the first few).
            known: Vec<String>,
        } => "{what} names the body `{name}`, which is not there: {}", one_of(known);
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
        } =>
                "massless cable `{cable}`: length is {length} m, but its path is {path:.6} m long, a strain of {:.3} % at the \
                 start: leave `length` out for the length of the path, give `slack` (m) or a smaller `tension` (N), or \
                 `strained = true` where it is meant so",
                100.0 * strain;
        /// A control or a program names a joint or cable that is not there.
        UnknownJoint {
            /// Who names it.
            what: String,
            /// The name.
            name: String,
            /// Names of those that it could be (the first few).
            known: Vec<String>,
        } => "{what} names `{name}`, which is not there{}", or_no_other(known);
        /// A program or a table names a control that is not there.
        UnknownControl {
            /// The name.
            name: String,
            /// Names of the controls that there are (the first few).
            known: Vec<String>,
        } => "no control is called `{name}`: {}", or_none(known);
        /// No side of a joint is a body that forces move.
        BothWorld {
            /// The joint.
            joint: String,
        } => "joint `{joint}` ties the world to the world: make one side a dynamic body";
        /// Both sides of a joint are the same body.
        SameBody {
            /// The joint.
            joint: String,
            /// The body.
            body: String,
        } => "joint `{joint}` ties body `{body}` to itself: make one side another body";
        /// A body is to be removed that a joint holds.
        Held {
            /// The body.
            body: String,
            /// The joint.
            joint: String,
        } => "body `{body}` cannot be removed while `{joint}` holds it: remove that as well";
        /// A joint has no rows.
        NoRows {
            /// The joint.
            joint: String,
        } => "joint `{joint}` has no rows: give it at least one of stretch, bend, twist";
        /// An inertia is not symmetric positive definite.
        Inertia {
            /// The body.
            body: String,
        } =>
                "the inertia of body `{body}` is not symmetric positive definite: give positive principal moments [kg m²]";
        /// The axes of a frame are not orthonormal and right-handed.
        Axes {
            /// The joint.
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
            /// Line from 1, when known.
            line: Option<usize>,
            /// Column from 1, when known.
            column: Option<usize>,
            /// Message of the reader.
            message: String,
        } => "{}{message}", at(*line, *column);
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
        } => "line {line}, column {column}: {}", naming(fault.to_string(), key);
        /// A scene holds something that no text can hold.
        NotInText {
            /// Name of that part of the scene.
            what: String,
            /// The cure.
            cure: &'static str,
        } => "a text cannot hold {what}: {cure}";
        /// An override `KEY=VALUE` does not fit.
        Override {
            /// The key.
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
fn at(line: Option<usize>, column: Option<usize>) -> String {
    match (line, column) {
        (Some(line), Some(column)) => format!("line {line}, column {column}: "),
        _ => String::new(),
    }
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
