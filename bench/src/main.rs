//! The program `taut`: the command line with the solvers of this workspace.

use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: taut_bench::Counting = taut_bench::Counting;

fn main() -> ExitCode {
    taut_bench::command_line(&[])
}
