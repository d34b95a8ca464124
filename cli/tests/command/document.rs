//! Documents whose tables and figures are made by tests.

use std::path::Path;

use lobes_cli::report::Chart;

/// Holds a document of `docs/reference` and its figures against what is made now, or writes them
/// where `LOBES_WRITE_DOCUMENTS` is set; `test` is what to run for that.
pub(crate) fn check(name: &str, test: &str, tables: &[(&str, String)], figures: &[(&str, Chart)]) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/reference");
    let path = folder.join(name);
    let text = std::fs::read_to_string(&path).unwrap();
    let mut made = text.clone();
    for (name, table) in tables {
        let (open, close) = (format!("<!-- table {name} -->\n"), "<!-- end -->");
        let start = made
            .find(&open)
            .unwrap_or_else(|| panic!("no table {name}"))
            + open.len();
        let end = start + made[start..].find(close).unwrap();
        made.replace_range(start..end, table);
    }
    if std::env::var_os("LOBES_WRITE_DOCUMENTS").is_some() {
        std::fs::write(&path, &made).unwrap();
        for (name, figure) in figures {
            std::fs::write(folder.join(name), figure.svg()).unwrap();
        }
        return;
    }
    let remedy = format!("run LOBES_WRITE_DOCUMENTS=1 cargo test --test command {test}");
    assert!(made == text, "docs/reference/{name} is stale; {remedy}");
    for (name, figure) in figures {
        assert!(
            std::fs::read_to_string(folder.join(name)).is_ok_and(|old| old == figure.svg()),
            "docs/reference/{name} is stale; {remedy}"
        );
    }
}
