//! What an ELF says of itself before it is flashed: its [`Hello`], in a section of its own.

use protocol::{Hello, Role};

/// The chip the firmware is built for.
pub const CHIP: &str = "STM32F429ZI";

/// The Hello of a firmware for this chip; `version` as cargo gives it, "major.minor.patch".
pub const fn hello(role: Role, version: &str) -> Hello {
    Hello::new(role, CHIP, parse(version))
}

const fn parse(version: &str) -> [u8; 3] {
    let bytes = version.as_bytes();
    let mut parts = [0u8; 3];
    let (mut part, mut at) = (0, 0);
    while at < bytes.len() {
        match bytes[at] {
            b'.' => part += 1,
            digit => {
                assert!(
                    digit.is_ascii_digit() && part < 3,
                    "a version is major.minor.patch"
                );
                parts[part] = parts[part] * 10 + (digit - b'0');
            }
        }
        at += 1;
    }
    parts
}

/// Puts the firmware's Hello into the ELF's `.ridgelink` section, where tools look before they flash.
#[macro_export]
macro_rules! identify {
    ($role:expr) => {
        /// Who this firmware is, on the wire and in the ELF.
        const HELLO: protocol::Hello = $crate::identity::hello($role, env!("CARGO_PKG_VERSION"));

        #[allow(unsafe_code, reason = "a section that only tools read")]
        #[used]
        #[unsafe(link_section = ".ridgelink")]
        static IDENTITY: [u8; protocol::HELLO_LENGTH] = HELLO.to_bytes();
    };
}
