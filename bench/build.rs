//! Leaves the compiler's version and the processor that is compiled for to the program, whose instruction counts hold
//! for those alone, the compiler's flags, and the options of `cargo` that choose the features it is built with.

use std::env;
use std::fs;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=CARGO_ENCODED_RUSTFLAGS");
    let compiler = env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let version = Command::new(compiler).arg("--version").output().ok();
    let version = version.and_then(|o| String::from_utf8(o.stdout).ok());
    let version = version.as_deref().map_or("", str::trim);
    println!(
        "cargo::rustc-env=TAUT_RUSTC={}",
        if version.is_empty() {
            "an unknown rustc"
        } else {
            version
        }
    );
    let flags = env::var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default();
    // The last one counts, as for the compiler.
    let cpu = flags
        .split('\x1f')
        .filter_map(|flag| flag.split_once("target-cpu=").map(|(_, cpu)| cpu))
        .next_back()
        .unwrap_or("generic");
    println!("cargo::rustc-env=TAUT_TARGET_CPU={cpu}");
    println!("cargo::rustc-env=TAUT_ENCODED_RUSTFLAGS={flags}");
    println!("cargo::rustc-env=TAUT_FEATURES={}", features());
}

/// The options that choose the features: those beside the default ones, or all where these are not on.
fn features() -> String {
    println!("cargo::rerun-if-changed=Cargo.toml");
    let manifest = fs::read_to_string("Cargo.toml").unwrap_or_default();
    let defaults = manifest.lines().find_map(|l| l.strip_prefix("default = "));
    let on = |name: &str| env::var_os(format!("CARGO_FEATURE_{name}")).is_some();
    let by_default = on("DEFAULT");
    let named = env::vars_os().filter_map(|(key, _)| {
        let name = key.to_str()?.strip_prefix("CARGO_FEATURE_")?;
        Some(name.to_lowercase().replace('_', "-"))
    });
    let listed = |name: &String| defaults.is_some_and(|d| d.contains(&format!("\"{name}\"")));
    let mut names: Vec<String> = named
        .filter(|name| name != "default" && !(by_default && listed(name)))
        .collect();
    names.sort();
    let mut options = Vec::new();
    if !by_default {
        options.push("--no-default-features".to_owned());
    }
    if !names.is_empty() {
        options.push(format!("--features {}", names.join(",")));
    }
    options.join(" ")
}
