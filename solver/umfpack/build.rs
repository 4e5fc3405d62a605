//! Finds the system's UMFPACK or compiles it from source; the crate documentation has the rules.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::{env, fs};

/// The registry package whose `vendor` folder holds the sources. Cargo.toml pins the same version.
const PACKAGE: (&str, &str) = ("suitesparse_sys", "0.1.4");

/// `UMFPACK_*` macros that size or index the Control and Info arrays.
const INDICES: &[&str] = &[
    "CONTROL",
    "INFO",
    "STRATEGY",
    "PIVOT_TOLERANCE",
    "SCALE",
    "IRSTEP",
    "SIZE_OF_UNIT",
    "PEAK_MEMORY",
    "FLOPS",
    "LNZ",
    "UNZ",
    "RCOND",
    "UMAX",
    "IR_TAKEN",
    "OMEGA1",
    "OMEGA2",
    "SOLVE_FLOPS",
];

/// `UMFPACK_*` macros that are statuses, settings or systems to solve.
const CODES: &[&str] = &[
    "OK",
    "WARNING_singular_matrix",
    "WARNING_determinant_underflow",
    "WARNING_determinant_overflow",
    "ERROR_out_of_memory",
    "ERROR_invalid_Numeric_object",
    "ERROR_invalid_Symbolic_object",
    "ERROR_argument_missing",
    "ERROR_n_nonpositive",
    "ERROR_invalid_matrix",
    "ERROR_different_pattern",
    "ERROR_invalid_system",
    "ERROR_invalid_permutation",
    "ERROR_internal_error",
    "ERROR_file_IO",
    "ERROR_ordering_failed",
    "ERROR_invalid_blob",
    "STRATEGY_AUTO",
    "STRATEGY_UNSYMMETRIC",
    "STRATEGY_SYMMETRIC",
    "SCALE_NONE",
    "SCALE_SUM",
    "SCALE_MAX",
    "A",
    "At",
];

const VERSION: &[&str] = &["MAIN_VERSION", "SUB_VERSION", "SUBSUB_VERSION"];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=TAUT_UMFPACK");
    println!("cargo::rerun-if-env-changed=SUITESPARSE_SRC");
    let as_system = || Ok(("system", system()?));
    let as_source = || Ok(("source", source()?));
    let library: Result<_, String> = match env::var("TAUT_UMFPACK").as_deref() {
        Ok("system") => as_system(),
        Ok("source") => as_source(),
        Ok("") | Err(_) => {
            as_system().or_else(|first| as_source().map_err(|second| format!("{first}\n{second}")))
        }
        Ok(other) => Err(format!(
            "TAUT_UMFPACK is `{other}`, but has to be `system`, `source` or unset"
        )),
    };
    match library {
        Ok((origin, version)) => {
            println!("cargo::rustc-env=TAUT_UMFPACK_ORIGIN={origin}");
            println!("cargo::rustc-env=TAUT_UMFPACK_VERSION={version}");
        }
        Err(message) => {
            for line in message.lines().filter(|line| !line.trim().is_empty()) {
                println!("cargo::error={line}");
            }
        }
    }
}

/// Links the installed library and returns its version.
fn system() -> Result<String, String> {
    const HELP: &str = "install it (Debian: `apt-get install libsuitesparse-dev`)";
    let probe = |name: &&str| {
        let mut config = pkg_config::Config::new();
        config.atleast_version("5.7").cargo_metadata(false);
        config.probe(name).ok()
    };
    let names = ["UMFPACK", "umfpack"];
    if let Some((name, library)) = names.iter().find_map(|name| Some((name, probe(name)?))) {
        let version = write_constants(&library.include_paths)
            .map_err(|e| format!("system UMFPACK: {e}; {HELP}"))?;
        // Link flags are printed last: a source build after a failure must not see them.
        pkg_config::probe_library(name).map_err(|e| e.to_string())?;
        return Ok(version);
    }
    // Some distributions, Debian 12 among them, install the library without a pkg-config file.
    let version = write_constants(&[])
        .and_then(|version| try_link().map(|()| version))
        .map_err(|e| format!("system UMFPACK: not known to pkg-config, and {e}; {HELP}"))?;
    println!("cargo::rustc-link-lib=umfpack");
    Ok(version)
}

/// Links a test program; fails unless the C compiler finds the library in its default folders.
fn try_link() -> Result<(), String> {
    let (source, program) = (out_dir("link.c"), out_dir("link"));
    let text = "void umfpack_di_defaults(double *);\n\
        int main(void) { double c[64]; umfpack_di_defaults(c); return 0; }\n";
    fs::write(&source, text).map_err(|e| e.to_string())?;
    let compiler = cc::Build::new().try_get_compiler();
    let status = compiler
        .map_err(|e| e.to_string())?
        .to_command()
        .arg(source)
        .arg("-o")
        .arg(program)
        .arg("-lumfpack")
        .stderr(Stdio::null())
        .status();
    match status {
        Ok(status) if status.success() => Ok(()),
        _ => Err("the linker does not find it".into()),
    }
}

/// Compiles the double, 32-bit index part of UMFPACK with AMD, without BLAS and CHOLMOD; returns the
/// version.
fn source() -> Result<String, String> {
    let root = match env::var_os("SUITESPARSE_SRC").filter(|root| !root.is_empty()) {
        Some(root) => {
            for package in ["UMFPACK", "AMD", "SuiteSparse_config"] {
                let folder = Path::new(&root).join(package);
                println!("cargo::rerun-if-changed={}", folder.display());
            }
            PathBuf::from(root)
        }
        None => locate()?,
    };
    let include = [
        "UMFPACK/Include",
        "UMFPACK/Source",
        "AMD/Include",
        "SuiteSparse_config",
    ]
    .map(|folder| root.join(folder));
    let version = write_constants(&include).map_err(|e| {
        format!(
            "UMFPACK from source: {e}; needed are a C compiler and the sources of SuiteSparse 7 in {}",
            root.display()
        )
    })?;

    let mut files = vec![root.join("SuiteSparse_config/SuiteSparse_config.c")];
    // One file for each int32 variant of the internal routines: the linker drops what is not used.
    files.extend(list(&root.join("UMFPACK/Source2"), |name| {
        name.starts_with("umf_i_") || name.starts_with("umf_di_")
    })?);
    files.extend(list(&root.join("AMD/Source"), |name| {
        !name.starts_with("amd_l")
    })?);
    files.extend(
        [
            "di_defaults",
            "di_symbolic",
            "di_qsymbolic",
            "di_numeric",
            "di_wsolve",
            "di_free_symbolic",
            "di_free_numeric",
            "gn_tictoc",
        ]
        .map(|name| root.join(format!("UMFPACK/Source2/umfpack_{name}.c"))),
    );
    cc::Build::new()
        .files(files)
        .includes(include)
        .define("NBLAS", None)
        .define("NCHOLMOD", None)
        .define("NTIMER", None)
        .define("NDEBUG", None)
        .opt_level(3)
        .debug(false)
        .warnings(false)
        .flag_if_supported("-w")
        .try_compile("umfpack")
        .map_err(|e| format!("UMFPACK from source: {e}; a C compiler is needed"))?;
    if env::var_os("CARGO_CFG_UNIX").is_some() {
        println!("cargo::rustc-link-lib=m");
    }
    Ok(version)
}

/// The C files of a folder that pass a filter, in the order of their names.
fn list(folder: &Path, wanted: fn(&str) -> bool) -> Result<Vec<PathBuf>, String> {
    let describe = |e| format!("UMFPACK from source: {}: {e}", folder.display());
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(describe)? {
        let path = entry.map_err(describe)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.ends_with(".c") && wanted(&name) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// The `vendor` folder of the registry package, which Cargo downloads first where it is missing.
fn locate() -> Result<PathBuf, String> {
    let manifest = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    metadata(&manifest, &["--locked"]).or_else(|_| {
        // As a dependency from a registry this package may stand alone, without a lock file.
        let folder = out_dir("locate");
        let (name, version) = PACKAGE;
        let text = format!(
            "[package]\nname = \"locate\"\nedition = \"2024\"\n\n[workspace]\n\n[lib]\npath = \"lib.rs\"\n\n\
             [target.'cfg(any())'.dependencies]\n\
             {name} = {{ version = \"={version}\", default-features = false }}\n"
        );
        fs::create_dir_all(&folder)
            .and_then(|()| fs::write(folder.join("lib.rs"), ""))
            .and_then(|()| fs::write(folder.join("Cargo.toml"), text))
            .map_err(|e| e.to_string())
            .and_then(|()| metadata(&folder, &[]))
            .map_err(|e| {
                format!(
                    "UMFPACK from source: Cargo does not provide the package {name} {version}; run \
                     `cargo fetch --locked` with network access, or set SUITESPARSE_SRC to the \
                     sources of SuiteSparse 7\n{e}"
                )
            })
    })
}

fn metadata(folder: &Path, arguments: &[&str]) -> Result<PathBuf, String> {
    let output = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .current_dir(folder)
        .args(["metadata", "--quiet", "--format-version", "1"])
        .args(arguments)
        .output()
        .map_err(|e| format!("cargo metadata: {e}"))?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned());
    }
    let metadata: serde_json::Value =
        serde_json::from_slice(&output.stdout).map_err(|e| format!("cargo metadata: {e}"))?;
    metadata["packages"]
        .as_array()
        .into_iter()
        .flatten()
        .find(|package| package["name"] == PACKAGE.0 && package["version"] == PACKAGE.1)
        .and_then(|package| package["manifest_path"].as_str())
        .map(|path| Path::new(path).with_file_name("vendor"))
        .ok_or_else(|| format!("cargo metadata: no package {} {}", PACKAGE.0, PACKAGE.1))
}

/// Takes the constants from the very header of the library, so that the Rust side cannot disagree.
/// Returns the version.
fn write_constants(include: &[PathBuf]) -> Result<String, String> {
    let mut probe = String::from(
        "#if __has_include(<umfpack.h>)\n#include <umfpack.h>\n\
         #elif __has_include(<suitesparse/umfpack.h>)\n#include <suitesparse/umfpack.h>\n#endif\n\
         #ifndef UMFPACK_ERROR_invalid_blob /* since 6.0 */\n\
         #define UMFPACK_ERROR_invalid_blob (-19)\n#endif\n",
    );
    for name in [INDICES, CODES, VERSION].concat() {
        probe += &format!("probe_{name} UMFPACK_{name}\n");
    }
    let file = out_dir("probe.c");
    fs::write(&file, probe).map_err(|e| e.to_string())?;
    let expanded = cc::Build::new()
        .file(&file)
        .includes(include)
        .cargo_warnings(false)
        .try_expand()
        .map_err(|e| e.to_string())?;
    let expanded = String::from_utf8_lossy(&expanded);
    // Macros of a header in a system folder are expanded onto lines of their own.
    let lines = expanded.lines().filter(|line| !line.starts_with('#'));
    let tokens: Vec<_> = lines.flat_map(str::split_whitespace).collect();
    let value = |name: &str| -> Result<i32, String> {
        tokens
            .windows(2)
            .find(|pair| pair[0].strip_prefix("probe_") == Some(name))
            .and_then(|pair| pair[1].trim_matches(['(', ')']).parse().ok())
            .ok_or_else(|| format!("umfpack.h is missing or does not define UMFPACK_{name}"))
    };

    let mut constants = String::new();
    for (names, kind) in [(INDICES, "usize"), (CODES, "i32")] {
        for name in names {
            let upper = name.to_uppercase();
            constants += &format!("pub(crate) const {upper}: {kind} = {};\n", value(name)?);
        }
    }
    fs::write(out_dir("constants.rs"), constants).map_err(|e| e.to_string())?;
    let version: Result<Vec<_>, _> = VERSION.iter().map(|name| value(name)).collect();
    Ok(version?
        .iter()
        .map(i32::to_string)
        .collect::<Vec<_>>()
        .join("."))
}

fn out_dir(name: &str) -> PathBuf {
    PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default()).join(name)
}
