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

/// The vector instructions that are used: `"avx512"`, `"avx2"` or `"baseline"`, which is SSE2 on x86-64 and what every machine of
/// its kind has elsewhere.
///
/// They are the widest that the machine has, found when they are first needed. The environment variable `LOBES_VECTORS`, read once, names
/// narrower ones; what the machine does not have, or no name at all, changes nothing. Each gives results within every contract, and not the same
/// bits: widths round sums in another order, and the baseline has no fused multiplication and addition.
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
