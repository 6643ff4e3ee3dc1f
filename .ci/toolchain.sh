# Sourced by ./demo and ./test: finds, or installs where it may, a Rust that builds for the host and
# for thumbv7em-none-eabihf, or says in one line what is missing.
#
# Two worlds:
# - ordinary: rustup (or anything else that brings the target's core library);
# - Debian, where rustup can fetch nothing: rustc, cargo and the library's sources from Debian's
#   packages, core built from them for the boards.
#
# Afterwards: host_cargo CARGO_ARGUMENTS… for the host, board_cargo CARGO_ARGUMENTS… for the boards,
# bare_cargo CARGO_ARGUMENTS… for the cores that they name with --target.

target=thumbv7em-none-eabihf
another_target=thumbv8m.main-none-eabihf   # which the libs are linked for as well, where it can be had
oldest_minor=$(sed -n 's/^rust-version = "1\.\([0-9]*\)"$/\1/p' Cargo.toml)
emulator_minor=98      # what the emulator's manifest asks for; older ones need to be told to go on

say() { printf '%s\n' "$*" >&2; }
fail() { say "ridgelink: $*"; exit 2; }
as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo -n "$@"; fi; }

rust_minor() { "${1:-rustc}" --version 2>/dev/null | sed -n 's/^rustc 1\.\([0-9]*\)\..*/\1/p'; }
new_enough() { [ "$(rust_minor "$1")" -ge "$oldest_minor" ] 2>/dev/null; }
has_target() {
    libraries=$(rustc --print target-libdir --target "$1" 2>/dev/null) && ls "$libraries"/libcore-*.rlib >/dev/null 2>&1
}

# A C linker is all that host builds need besides Rust.
need_linker() {
    command -v cc >/dev/null 2>&1 && return
    command -v apt-get >/dev/null 2>&1 || fail "no C linker (cc): install a C compiler"
    as_root apt-get update -qq >&2 && as_root apt-get install -y -qq gcc libc6-dev >&2 \
        || fail "no C linker (cc), and apt-get could not install gcc: install it as root"
}

# A browser and its driver, for the tests of a page; without them they are skipped.
want_browser() {
    command -v chromedriver >/dev/null 2>&1 && return
    { command -v apt-get && as_root apt-get update -qq && as_root apt-get install -y -qq chromium chromium-driver; } >/dev/null 2>&1 \
        || say "ridgelink: no chromedriver, and apt-get could not install chromium-driver: no browser looks at the page of host-bridge live"
}

# A second emulator of the Cortex-M4F, for a test of the libs; without it the test is skipped. Nothing that is
# installed has to make room for it.
want_qemu() {
    command -v qemu-system-arm >/dev/null 2>&1 && return
    { command -v apt-get && as_root apt-get update -qq \
        && as_root apt-get install -y -qq --no-remove --no-install-recommends qemu-system-arm; } >/dev/null 2>&1 \
        || say "ridgelink: no qemu-system-arm, and apt-get could not install it: the libs run on one emulated Cortex-M4F only"
}

ordinary_world() {
    command -v rustc >/dev/null 2>&1 && command -v cargo >/dev/null 2>&1 && new_enough rustc || return 1
    add_target "$target"
}
add_target() {
    has_target "$1" && return
    command -v rustup >/dev/null 2>&1 || return 1
    say "ridgelink: adding $1 to rustup's toolchain"
    rustup target add "$1" >&2 && has_target "$1"
}

debian_packages="rustc-web cargo-web rust-web-src rust-web-clippy rustfmt-web lld-19"
debian_ready() {
    new_enough /usr/bin/rustc && [ -x /usr/bin/cargo ] && [ -x /usr/bin/cargo-clippy ] \
        && [ -x /usr/bin/cargo-fmt ] && [ -x /usr/lib/llvm-19/bin/lld ] \
        && ls -d /usr/lib/rustlib/src/rust/library/core >/dev/null 2>&1
}
debian_world() {
    command -v apt-get >/dev/null 2>&1 || return 1
    if ! debian_ready; then
        say "ridgelink: rustup has no $target here; installing $debian_packages from Debian's packages"
        as_root apt-get update -qq >&2 || return 1
        # shellcheck disable=SC2086
        as_root apt-get install -y -qq $debian_packages >&2 || return 1
        debian_ready || return 1
    fi
    links=$PWD/target/toolchain
    mkdir -p "$links" && ln -sf /usr/lib/llvm-19/bin/lld "$links/rust-lld"
    PATH=$links:/usr/bin:$PATH
    export PATH
}

world=
if [ "${RIDGELINK_WORLD:-ordinary}" = ordinary ] && ordinary_world; then
    world=ordinary
elif debian_world; then
    world=debian
else
    fail "no Rust 1.$oldest_minor or later with the target $target: run 'rustup update stable && rustup target add $target'"
fi
need_linker

ignore_version=
[ "$(rust_minor rustc)" -ge "$emulator_minor" ] || ignore_version=--ignore-rust-version

# The subcommand's own binary is named, so that no other toolchain's is found first.
cargo_of() {
    subcommand=$1
    case $world-$subcommand in
        debian-clippy) /usr/bin/cargo-clippy "$@" ;;
        debian-fmt) /usr/bin/cargo-fmt "$@" ;;
        debian-*) /usr/bin/cargo "$@" ;;
        *) cargo "$@" ;;
    esac
}

host_cargo() {
    subcommand=$1
    shift
    # shellcheck disable=SC2086
    cargo_of "$subcommand" --locked $ignore_version "$@"
}

bare_cargo() {
    if [ "$world" = debian ]; then
        RUSTC_BOOTSTRAP=1 CARGO_UNSTABLE_BUILD_STD=core host_cargo "$@"
    else
        host_cargo "$@"
    fi
}

board_cargo() {
    subcommand=$1
    shift
    bare_cargo "$subcommand" --target "$target" "$@"
}

build_firmwares() {
    board_cargo build --release -p firmware-sensor -p firmware-display
}

# What hil-sim cost and hil-sim chart estimators count the instructions of, and what watches the clock.
build_examples() {
    board_cargo build --release -p firmware-sensor --example filter_cost --example estimator_cost --example clock
}

# The tests that run on a board, each as target/on-target/PACKAGE-TEST, without the hash that cargo gives it. Cargo
# builds the packages' bins as well, with what only tests need in sight: build_firmwares comes after it.
build_on_target() {
    folder=${CARGO_TARGET_DIR:-target}/on-target
    mkdir -p "$folder"
    built=$(board_cargo test --release --no-run --message-format=json-render-diagnostics \
        -p firmware-sensor -p firmware-display --test on_target --test restarts) || return
    printf '%s\n' "$built" \
        | sed -n 's|.*"package_id":"[^"]*\(firmware-[a-z]*\)[# ].*"executable":"\([^"]*/deps/\([a-z_]*\)-[0-9a-f]*\)".*|\2 \1-\3|p' \
        | while read -r elf name; do cp "$elf" "$folder/$name"; done
}

# The libs without a HAL: in a program for no board of ours, linked for the boards' core and for another one,
# and the same for the boards' own chip.
link_plain_board() {
    manifest=tests/plain-board/Cargo.toml
    tree=$(cargo_of tree --locked --manifest-path $manifest --target all --edges normal,build --prefix none)
    intruders=$(printf '%s\n' "$tree" | sed -nE '/^cortex-m-rt/d; s/^((cortex-m|defmt|embassy|nucleo|stm32)[^ ]*) .*/\1/p' | sort -u)
    # shellcheck disable=SC2086
    [ -z "$intruders" ] || fail "a program of the libs alone gets what only the boards need:" $intruders
    set -- --target "$target"
    # Debian's library is built from source for any core.
    if [ "$world" = debian ] || add_target "$another_target"; then
        set -- "$@" --target "$another_target"
    else
        say "ridgelink: $another_target is not to be had here: the libs are linked for $target alone"
    fi
    # RUSTFLAGS take the place of the boards' linker scripts, which cargo finds in .cargo/config.toml.
    RUSTFLAGS= bare_cargo build --manifest-path $manifest \
        --target-dir "${CARGO_TARGET_DIR:-target}/plain-board" "$@"
}
