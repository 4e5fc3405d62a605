//! The folder of a contact problem: FCLIB's names, Matrix Market files, with `.gz` after the names where compressed.
//!
//! | file | holds |
//! |---|---|
//! | `info.toml` | what the numbers mean, and where they come from |
//! | `M.mtx` | n × n, symmetric, blocks of the bodies |
//! | `G.mtx`, `H.mtx` | n × p of joints, n × m of contacts |
//! | `f.mtx`, `b.mtx`, `w.mtx` | n, p and m numbers |
//! | `mu.mtx` | n_c = m/3 numbers |
//! | `Sigma_G.mtx`, `Sigma_H.mtx` | diagonals, p and m numbers; FCLIB has none |
//! | `v.mtx`, `lambda.mtx`, `r.mtx` | the solution that was found, where there is one |

use super::{ContactProblem, ContactSolution};
use crate::files::{FileError, Output, make_folder, read_text, remove};
use crate::matrix::market::{self, Fault, Market, MarketError};
use crate::matrix::{member, shape, vector_of, write};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::{Path, PathBuf};
use taut_integrator::Entry;
use taut_solver::GeneralMatrix;

/// Name of the description.
pub const INFO: &str = "info.toml";

/// Most rows of contacts: W holds their square, half a gigabyte.
pub const MOST_ROWS: usize = 8190;

/// Description of the numbers. The first three fields are FCLIB's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Info {
    pub title: String,
    /// Where it comes from.
    #[serde(default)]
    pub description: String,
    /// Equations, signs and units.
    #[serde(default)]
    pub math_info: String,
    /// Rows of a contact: 3.
    pub spacedim: usize,
    /// Components of velocity n, rows of joints p, and of contacts m.
    pub sizes: [usize; 3],
    pub step: Option<Step>,
}

/// Step in which the problem arose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// The scene, with what was set.
    pub scene: String,
    /// Steps before it.
    pub step: u64,
    /// Time at its beginning \[s].
    pub time: f64,
    /// Its length \[s].
    pub dt: f64,
    /// Solver of r, λ and v: method and backend.
    pub solver: String,
}

/// Equations, signs and units of every problem written here.
const MATH: &str = "\
M v = H r + G lambda + f
G' v + Sigma_G lambda + b = 0
u = H' v + Sigma_H r + w
Each contact: r_N >= 0, u_N >= 0, r_N u_N = 0, |r_T| <= mu r_N, u_T = 0 or u_T against r_T with |r_T| = mu r_N.
FCLIB's global problem is that with Sigma_G = Sigma_H = 0, diagonal matrices that are stored as vectors.
v: velocities at the end of the step, of each moving body x y z (m/s), then about x y z (rad/s), world frame.
M: effective inertia, a block a body (kg, kg m^2), with the geometric stiffness of the step.
G: Jacobian of the joints, transposed; lambda: their impulses (N s, of angles N m s); Sigma_G: their compliance and damping
over the step (1/kg, of angles 1/(kg m^2)).
H: Jacobian of the contacts, transposed, three columns each: along the normal, from the second shape to the first, and two
tangents; r: impulses on the first shape (N s), u: its velocity relative to the second (m/s).
Sigma_H: regularisation and compliance of the contacts (1/kg).
f = M v_0 + dt (external forces), with v_0 at the beginning; b, w: minus what the joints' rates are to be, gaps over dt,
and what static and driven bodies move.
Rows of joints that are at a bound of their force are empty columns of G, their impulse is in f.
Contacts that stay open are left out.
";

impl Info {
    /// Description of a problem in its step.
    #[must_use]
    pub fn new(problem: &ContactProblem, step: Step) -> Self {
        Self {
            title: format!("contacts of {}, step {}", step.scene, step.step),
            description: "global frictional contact problem of one time step, joints regularised"
                .to_owned(),
            math_info: MATH.to_owned(),
            spacedim: 3,
            sizes: [
                problem.impulse.len(),
                problem.joint_rates.len(),
                problem.contact_rates.len(),
            ],
            step: Some(step),
        }
    }
}

/// Why a contact problem is not read.
#[derive(Debug)]
pub enum ProblemError {
    /// The folder has no description.
    None(PathBuf),
    /// A file that cannot be read.
    File(FileError),
    /// A malformed description.
    Info { path: PathBuf, fault: String },
    /// A file that is missing, damaged or does not fit the others.
    Member(MarketError),
}

impl fmt::Display for ProblemError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None(folder) => write!(
                f,
                "`{}` holds no contact problem, as it has no {INFO}: write one with `taut dump SCENE --step K --out DIR`",
                folder.display()
            ),
            Self::File(e) => e.fmt(f),
            Self::Info { path, fault } => write!(f, "{}: {fault}", path.display()),
            Self::Member(e) => e.fmt(f),
        }
    }
}

impl std::error::Error for ProblemError {}

impl From<FileError> for ProblemError {
    fn from(e: FileError) -> Self {
        Self::File(e)
    }
}

impl From<MarketError> for ProblemError {
    fn from(e: MarketError) -> Self {
        Self::Member(e)
    }
}

/// Writes a problem to `folder` and returns its files.
///
/// # Errors
/// [`FileError`].
pub fn write(
    problem: &ContactProblem,
    info: &Info,
    folder: &Path,
    gzip: bool,
) -> Result<Vec<PathBuf>, FileError> {
    make_folder(folder)?;
    let [n, p, m] = info.sizes;
    let title = [info.title.clone()];
    let mut written = Vec::new();
    let mut put = |name: &str, text: &str| {
        // Removes a file of an earlier problem with the other ending: the reader would take it for
        // one of these.
        for ending in ["mtx", "mtx.gz"] {
            remove(&folder.join(format!("{name}.{ending}")))?;
        }
        written.push(write::file(folder, name, text, gzip)?);
        Ok::<(), FileError>(())
    };
    let (bodies, joints) = (&problem.bodies, &problem.joints);
    let m_text = write::coordinates(&problem.inertia, [n, n], true, bodies, &title);
    put("M", &m_text)?;
    let g_text = write::coordinates(&problem.of_joints, [n, p], false, joints, &title);
    put("G", &g_text)?;
    let h_text = write::coordinates(&problem.of_contacts, [n, m], false, &[], &title);
    put("H", &h_text)?;
    let solution = problem.solution.iter();
    let found = solution.flat_map(|s| {
        [
            ("v", &s.velocities),
            ("lambda", &s.joints),
            ("r", &s.contacts),
        ]
    });
    let vectors = [
        ("f", &problem.impulse),
        ("b", &problem.joint_rates),
        ("w", &problem.contact_rates),
        ("mu", &problem.friction),
        ("Sigma_G", &problem.joint_regularization),
        ("Sigma_H", &problem.contact_regularization),
    ];
    for (name, vector) in vectors.into_iter().chain(found) {
        put(name, &write::vector(vector, &title))?;
    }
    let path = folder.join(INFO);
    let text = toml::to_string_pretty(info).map_err(|e| FileError {
        path: path.clone(),
        doing: "write",
        source: std::io::Error::other(e),
    })?;
    Output::open(&path)?.write(|out| out.write_all(text.as_bytes()))?;
    written.push(path);
    Ok(written)
}

/// The folder of a problem that is named by itself or by its description; `None` for another file.
#[must_use]
pub fn folder_of(path: &Path) -> Option<&Path> {
    if path.is_dir() {
        return Some(path);
    }
    let named = path.file_name().is_some_and(|name| name == INFO);
    named.then(|| path.parent().unwrap_or(Path::new(".")))
}

/// Reads the problem of a folder.
///
/// # Errors
/// [`ProblemError`].
pub fn read(folder: &Path) -> Result<(ContactProblem, Info), ProblemError> {
    let info = read_info(folder)?;
    let [n, p, m] = info.sizes;
    let open = |name: &str| {
        let path = member(folder, name);
        market::read(&path).map(|market| (market, path))
    };
    let ((m_file, m_path), (g_file, g_path), (h_file, h_path)) =
        (open("M")?, open("G")?, open("H")?);
    for (path, file, sizes) in [
        (&m_path, &m_file, [n, n]),
        (&g_path, &g_file, [n, p]),
        (&h_path, &h_file, [n, m]),
    ] {
        if [file.rows, file.columns] != sizes {
            let [rows, columns] = sizes;
            let message = format!(
                "{} × {}, where {INFO} says {rows} × {columns}",
                file.rows, file.columns
            );
            return Err(shape(path, message).into());
        }
    }
    let (sigma, sigma_path) = open("Sigma_G")?;
    // Before anything is made that is as large as the description says.
    for (path, wanted, entries) in [
        (&m_path, n, m_file.entries.len()),
        (&g_path, p, g_file.entries.len() + sigma.entries.len()),
        (&h_path, m, 3 * h_file.entries.len()),
    ] {
        if wanted > entries {
            let message =
                format!("too few entries for {wanted} rows or columns: some hold nothing");
            return Err(shape(path, message).into());
        }
    }
    let vector = |name: &str, n: usize| {
        let (file, path) = open(name)?;
        vector_of(&file, &path, n)
    };
    let mut problem = ContactProblem {
        bodies: m_file.blocks.clone(),
        joints: g_file.blocks.clone(),
        inertia: lower_triangle(&m_file, &m_path)?,
        impulse: vector("f", n)?,
        joint_rates: vector("b", p)?,
        contact_rates: vector("w", m)?,
        friction: positive("mu", folder, vector("mu", m / 3)?)?,
        joint_regularization: positive("Sigma_G", folder, vector_of(&sigma, &sigma_path, p)?)?,
        contact_regularization: positive("Sigma_H", folder, vector("Sigma_H", m)?)?,
        of_joints: g_file.entries,
        of_contacts: h_file.entries,
        solution: None,
    };
    if member(folder, "v").exists() {
        problem.solution = Some(ContactSolution {
            velocities: vector("v", n)?,
            joints: vector("lambda", p)?,
            contacts: vector("r", m)?,
        });
    }
    Ok((problem, info))
}

fn read_info(folder: &Path) -> Result<Info, ProblemError> {
    let path = folder.join(INFO);
    if !path.is_file() {
        return Err(ProblemError::None(folder.to_owned()));
    }
    let text = read_text(&path)?;
    let fault = |fault: String| ProblemError::Info {
        path: path.clone(),
        fault,
    };
    let info: Info = toml::from_str(&text).map_err(|e| {
        let before = text.get(..e.span().map_or(0, |span| span.start));
        let line = 1 + before.unwrap_or_default().matches('\n').count();
        fault(format!("line {line}: {}", e.message().trim()))
    })?;
    let [n, _, m] = info.sizes;
    let checks = [
        (
            info.spacedim == 3,
            format!("`spacedim` is {}: it has to be 3", info.spacedim),
        ),
        (
            n > 0 && m > 0 && m.is_multiple_of(3),
            format!(
                "`sizes` are {:?}: n, p and m, of which n is positive and m a multiple of 3",
                info.sizes
            ),
        ),
        (
            m <= MOST_ROWS,
            format!(
                "{} contacts are more than the {} that are solved at once",
                m / 3,
                MOST_ROWS / 3
            ),
        ),
    ];
    match checks.into_iter().find(|(sound, _)| !sound) {
        Some((_, what)) => Err(fault(what)),
        None => Ok(info),
    }
}

/// The lower triangle of M, whose entries at one place are added.
fn lower_triangle(file: &Market, path: &Path) -> Result<Vec<Entry>, MarketError> {
    let all = GeneralMatrix::from_entries(file.rows, file.entries.clone());
    let all = all.map_err(|e| shape(path, e.to_string()))?;
    if !file.symmetric && !all.is_symmetric() {
        return Err(shape(path, "M has to be symmetric".to_owned()));
    }
    let mut lower = Vec::with_capacity(all.values().len());
    all.for_each(|r, c, value| {
        if r >= c {
            lower.push((r, c, value));
        }
    });
    Ok(lower)
}

/// Numbers that are not negative.
fn positive(name: &str, folder: &Path, numbers: Vec<f64>) -> Result<Vec<f64>, MarketError> {
    match numbers.iter().position(|x| *x < 0.0) {
        None => Ok(numbers),
        Some(at) => Err(MarketError {
            fault: Fault::Value,
            ..shape(
                &member(folder, name),
                format!("number {} is {}: none may be negative", at + 1, numbers[at]),
            )
        }),
    }
}
