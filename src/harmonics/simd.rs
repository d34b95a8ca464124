//! The choice of vectors at run time.

/// Runs an expression with the widest vectors of the machine: on x86 AVX-512, AVX2 or the baseline,
/// elsewhere what there is. Like [`fearless_simd::dispatch`], which compiles every level that it
/// knows.
macro_rules! wide {
    ($level:expr, $simd:ident => $body:expr) => {{
        let level: fearless_simd::Level = $level;
        #[cfg(target_arch = "x86_64")]
        {
            use fearless_simd::Simd as _;
            if let Some($simd) = level.as_avx512() {
                $simd.vectorize(
                    #[inline(always)]
                    || $body,
                )
            } else if let Some($simd) = level.as_avx2() {
                $simd.vectorize(
                    #[inline(always)]
                    || $body,
                )
            } else if let Some($simd) = level.as_sse2() {
                $simd.vectorize(
                    #[inline(always)]
                    || $body,
                )
            } else {
                unreachable!("every x86-64 has SSE2")
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        {
            fearless_simd::dispatch!(level, $simd => $body)
        }
    }};
}

pub(crate) use wide;
