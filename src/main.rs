//! The `lobes` command.

fn main() -> std::process::ExitCode {
    lobes::cli::main()
}
