//! What the command needs of memory to read its own files.

#[path = "../../tests/counting_allocator/mod.rs"]
mod counting_allocator;

use counting_allocator::{Counting, allocations, most_bytes};
use lobes_cli::readers;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// TOML of N bytes takes no more than 2¹⁰ N and 1 MiB, whatever it holds.
#[test]
fn memory_of_toml() {
    let entry =
        |i: usize| format!("[[material]]\nname='{i}'\nkind='plastic'\nreflectance=[0,0,0]\n");
    for text in [
        (0..1000).map(entry).collect::<String>(),
        "[[material]]\n".repeat(5000),
        format!("a={}", "[".repeat(5000)),
        "a.".repeat(5000),
    ] {
        let mut most = 0;
        let asked = allocations(|| {
            most = most_bytes(|| {
                let _ = (readers::materials(&text), readers::set(&text));
            });
        });
        assert!(
            asked > 0 && most <= (text.len() << 10) + (1 << 20),
            "{most}"
        );
    }
}
