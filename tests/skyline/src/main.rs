//! The program `taut` with one more solver.

#[global_allocator]
static ALLOCATOR: taut_bench::Counting = taut_bench::Counting;

fn main() -> std::process::ExitCode {
    taut_bench::command_line(&[taut_skyline::SKYLINE])
}
