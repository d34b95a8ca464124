//! The `lobes` command.

fn main() -> std::process::ExitCode {
    lobes_cli::main()
}
