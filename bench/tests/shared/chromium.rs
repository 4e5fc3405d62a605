//! Headless Chromium, where it is.

use std::io::Write;
use std::path::Path;
use std::process::Command;

/// Chromium with the common options of its tests and a profile in this folder. `None` if it is not
/// installed; fails then if `TAUT_CHROMIUM` requires it.
pub(crate) fn chromium(profile: &Path) -> Option<Command> {
    let runs = |program: &&str| {
        let tried = Command::new(program).arg("--version").output();
        tried.is_ok_and(|output| output.status.success())
    };
    let Some(program) = ["chromium", "chromium-browser"].into_iter().find(runs) else {
        let required = std::env::var_os("TAUT_CHROMIUM").is_some_and(|v| v == "required");
        assert!(!required, "Chromium is not here");
        // Past what the harness keeps of a test that passes.
        let _ = writeln!(
            std::io::stderr(),
            "no Chromium here: no page is opened in a browser"
        );
        return None;
    };
    let mut command = Command::new(program);
    command
        .args(["--headless", "--no-sandbox", "--disable-gpu"])
        .args(["--no-first-run", "--disable-background-networking"])
        .args(["--disable-component-update", "--disable-sync"])
        .arg(format!("--user-data-dir={}", profile.display()));
    Some(command)
}
