//! The `mocban` program.

fn main() -> std::process::ExitCode {
    mocban::cli::main(std::env::args_os()).into()
}
