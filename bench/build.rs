//! Leaves the compiler's version and the processor that is compiled for to the program, whose instruction counts hold
//! for those alone.

use std::env;
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
}
