//! Prints the contents of `ACCURACY.md`.

use std::path::Path;

fn main() -> lobes::Result<()> {
    let snapshots = lobes::contracts::Snapshots::find(Path::new("."))?;
    print!("{}", lobes::contracts::table(&snapshots));
    Ok(())
}
