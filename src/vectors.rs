//! Which vector instructions are used.

use std::sync::OnceLock;

use fearless_simd::Level;

/// The level that every plan uses: the machine's own, unless the environment asks for a lower one.
pub(crate) fn level() -> Level {
    static LEVEL: OnceLock<Level> = OnceLock::new();
    *LEVEL.get_or_init(|| {
        let own = Level::new();
        let asked = std::env::var("LOBES_VECTORS").unwrap_or_default();
        lowered(own, &asked).unwrap_or(own)
    })
}

#[cfg(target_arch = "x86_64")]
fn lowered(own: Level, asked: &str) -> Option<Level> {
    match asked {
        "avx512" => own.as_avx512().map(Level::Avx512),
        "avx2" => own.as_avx2().map(Level::Avx2),
        "baseline" => own.as_sse2().map(Level::Sse2),
        _ => None,
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn lowered(_: Level, asked: &str) -> Option<Level> {
    (asked == "baseline").then(Level::baseline)
}

/// Whether vectors of this level hold eight doubles, as many as a ring's octet has: only AVX-512
/// does.
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
pub(crate) fn hold_eight(level: Level) -> bool {
    level.as_avx512().is_some()
}

/// Whether vectors of this level hold eight doubles, as many as a ring's octet has: only AVX-512
/// does.
#[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
pub(crate) fn hold_eight(_: Level) -> bool {
    false
}

/// The vector instructions that are used: `"avx512"`, `"avx2"` or `"baseline"`, which is SSE2 on
/// x86-64 and what every machine of its kind has elsewhere: NEON on 64-bit ARM, SIMD128 in
/// WebAssembly that was compiled for it, else no vectors.
///
/// They are the widest that the machine has, found when they are first needed. The environment
/// variable `LOBES_VECTORS`, read once, names narrower ones; what the machine does not have, or no
/// name at all, changes nothing. Each gives results within every contract, and not the same bits:
/// widths round sums in another order, and the baseline has no fused multiplication and addition.
///
/// ```
/// println!("computed with {}", lobes::vectors());
/// ```
pub fn vectors() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        let level = level();
        if level.as_avx512().is_some() {
            return "avx512";
        } else if level.as_avx2().is_some() {
            return "avx2";
        }
    }
    "baseline"
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    /// What exists on x86 only, in this crate's vector layer and in the standard library.
    const X86_ONLY: [&str; 11] = [
        "as_avx512",
        "as_avx2",
        "as_sse4_2",
        "as_sse2",
        "Level::Avx512",
        "Level::Avx2",
        "Level::Sse4_2",
        "Level::Sse2",
        "is_x86_feature_detected",
        "arch::x86_64",
        "arch::x86::",
    ];

    const GUARDS: [&str; 2] = [
        "#[cfg(target_arch = \"x86_64\")]",
        "#[cfg(any(target_arch = \"x86\", target_arch = \"x86_64\"))]",
    ];

    /// The lines, from 1, that name what is x86's outside an item, a statement or a block under one
    /// of [`GUARDS`].
    fn unguarded(source: &str) -> Vec<usize> {
        let mut depth = 0i32;
        // Inside a guarded item: the depth at which its attribute stands, and whether its braces
        // have been opened.
        let mut guarded: Option<(i32, bool)> = None;
        let mut found = Vec::new();
        for (number, line) in source.lines().enumerate() {
            let code = line.split("//").next().unwrap_or_default();
            if code.trim_start().starts_with("#[cfg(test)]") {
                break; // tests stand last in a file
            }
            if guarded.is_none() && GUARDS.iter().any(|guard| code.contains(guard)) {
                guarded = Some((depth, false));
                continue; // an attribute has its line to itself
            }
            if guarded.is_none() && X86_ONLY.iter().any(|name| code.contains(name)) {
                found.push(number + 1);
            }
            for character in code.chars() {
                match character {
                    '{' => depth += 1,
                    '}' => depth -= 1,
                    _ => {}
                }
                guarded = match guarded {
                    Some((start, _)) if depth > start => Some((start, true)),
                    // Its block has closed, or it was a statement without one.
                    Some((start, opened)) if depth < start || opened || character == ';' => None,
                    other => other,
                };
            }
        }
        found
    }

    /// Every `.rs` file under a folder.
    fn sources(folder: &Path, out: &mut Vec<std::path::PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                sources(&path, out);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                out.push(path);
            }
        }
    }

    /// What a compiler for another processor would refuse is found without one. `.ci/run` asks such
    /// compilers too, where it can have them.
    #[test]
    fn nothing_of_x86_stands_outside_its_cfg() {
        let mut files = Vec::new();
        sources(
            &Path::new(env!("CARGO_MANIFEST_DIR")).join("src"),
            &mut files,
        );
        assert!(files.len() > 100, "{} files", files.len());
        for file in files {
            let lines = unguarded(&std::fs::read_to_string(&file).unwrap());
            assert!(lines.is_empty(), "{}: lines {lines:?}", file.display());
        }
    }

    #[test]
    fn the_search_finds_what_is_not_guarded() {
        let guard = GUARDS[0];
        let call = "let width = if level.as_avx512().is_some() { 4 } else { 1 };";
        assert_eq!(unguarded(call), [1]);
        assert_eq!(unguarded(&format!("fn f() {{\n{call}\n}}\n")), [2]);
        assert!(unguarded(&format!("{guard}\nfn f(a: u8, b: u8) {{\n{call}\n}}\n")).is_empty());
        // The guard ends with its item, and a statement's with the statement.
        assert_eq!(
            unguarded(&format!("{guard}\nfn f() {{\n}}\nfn g() {{\n{call}\n}}\n")),
            [5]
        );
        assert_eq!(
            unguarded(&format!("fn f() {{\n{guard}\nlet a = 1;\n{call}\n}}\n")),
            [4]
        );
        // That of another processor is none.
        assert_eq!(
            unguarded(&format!(
                "#[cfg(not(target_arch = \"x86_64\"))]\nfn f() {{\n{call}\n}}\n"
            )),
            [3]
        );
        assert!(unguarded("// as_avx512 is named here\n").is_empty());
    }
}
