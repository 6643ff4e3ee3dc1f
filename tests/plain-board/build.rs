//! Gives each program its memory, and lets the linker find cortex-m-rt's link.x.

fn main() {
    println!("cargo:rerun-if-changed=memory");
    let here = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    for (program, memory) in [("plain-board", "plain"), ("plain-stm32f4", "stm32f4")] {
        println!("cargo:rustc-link-arg-bin={program}=-L{here}/memory/{memory}");
    }
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
}
