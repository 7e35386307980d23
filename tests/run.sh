#!/bin/sh
# Installs what is missing, then checks and tests everything, the emulated microcontroller included.
# Stops at the first failure and says which step it was. Needs only Rust (https://rustup.rs) on Debian or Ubuntu.
# usage: tests/run.sh
# IMPROMPTU_FUZZ_SECONDS: how long the decoders are fuzzed, both together (20)
set -eu
cd "$(dirname "$0")/.."
target=thumbv7em-none-eabihf
oldest=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)

step=start
say() { step=$1; printf '\n== %s\n' "$1"; }
fail() { trap - EXIT; printf '\ntests/run.sh: FAILED: %s\n' "$1" >&2; exit 1; }
trap 'code=$?; [ $code -eq 0 ] || printf "\ntests/run.sh: FAILED at: %s\n" "$step" >&2; exit $code' EXIT
has() { command -v "$1" >/dev/null 2>&1; }

# Runs a command as root.
as_root() {
    if [ "$(id -u)" -eq 0 ]; then "$@"; else has sudo || fail "run as root: $*"; sudo "$@"; fi
}

# Installs distribution packages, or says how: install PACKAGES OTHERWISE
install() {
    has apt-get || fail "$1 is missing; ${2:-install it}"
    as_root apt-get update --quiet || true
    # shellcheck disable=SC2086 # a list of packages
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends $1 ||
        fail "this did not work: sudo apt-get install $1"
}

say "tools"
# cc also builds the cycle model of `cargo mcu`, a plugin of QEMU; it needs no header of QEMU.
has cc || install "gcc libc6-dev" "macOS: run xcode-select --install"
has c++ || install "g++ libc6-dev" "macOS: run xcode-select --install"
has qemu-system-arm || install qemu-system-arm "macOS: run brew install qemu"
has arm-none-eabi-gcc || install "gcc-arm-none-eabi libnewlib-arm-none-eabi" "macOS: run brew install --cask gcc-arm-embedded"
has cargo && has rustc || fail "Rust is missing; install it from https://rustup.rs"
rustc --version
version=$(rustc --version | cut -d' ' -f2)
[ "$(printf '%s\n%s\n' "$oldest" "$version" | sort -V | head -n 1)" = "$oldest" ] ||
    fail "Rust $version is older than $oldest; run: rustup update stable"
# Flags from outside would change what is built, above all for the microcontroller (.cargo/config.toml).
unset RUSTFLAGS RUSTDOCFLAGS CARGO_BUILD_TARGET

for component in rustfmt clippy; do
    cargo "$(echo $component | sed 's/rustfmt/fmt/')" --version >/dev/null 2>&1 ||
        { has rustup && rustup component add $component; } ||
        fail "$component is missing; run: rustup component add $component"
done

has_target() { [ -d "$(rustc --print target-libdir --target $target)" ]; }
if [ -z "${IMPROMPTU_THUMB_TOOLCHAIN:-}" ] && ! has_target; then
    say "target $target"
    { has rustup && rustup target add $target; } || {
        echo "rustup cannot add it: making it from the distribution's packages"
        IMPROMPTU_THUMB_TOOLCHAIN=$PWD/target/thumb-toolchain
        [ -x "$IMPROMPTU_THUMB_TOOLCHAIN/bin/cargo" ] || {
            has apt-get || fail "the target $target is missing; run: rustup target add $target"
            as_root apt-get update --quiet || true
            install "$(tests/thumb-toolchain.sh --packages)"
            tests/thumb-toolchain.sh "$IMPROMPTU_THUMB_TOOLCHAIN"
        }
        export IMPROMPTU_THUMB_TOOLCHAIN
    }
fi
# cargo of the toolchain that has the target.
cross() {
    [ -z "${IMPROMPTU_THUMB_TOOLCHAIN:-}" ] || PATH=$IMPROMPTU_THUMB_TOOLCHAIN/bin:$PATH
    cargo "$@"
}

say "formatting"
cargo fmt --all --check || fail "formatting; run: cargo fmt --all"
cargo fmt --manifest-path tests/fuzz/Cargo.toml --check || fail "formatting; run: cargo fmt --manifest-path tests/fuzz/Cargo.toml"

say "locked versions of the fuzz targets"
cargo metadata --manifest-path tests/fuzz/Cargo.toml --locked --format-version 1 >/dev/null ||
    fail "tests/fuzz/Cargo.lock is not up to date; run: cargo update --workspace --manifest-path tests/fuzz/Cargo.toml"

say "clippy"
cargo clippy --workspace --all-targets --locked -- -D warnings

say "clippy, microcontroller"
(cross clippy --package impromptu-firmware --package impromptu-c-abi --package impromptu-mcu-benchmark --package impromptu-planted --lib --bins --locked --target $target --profile firmware --target-dir target/firmware -- -D warnings)
(cross clippy --package impromptu-board --lib --bins --locked --target $target --profile board --target-dir target/firmware -- -D warnings)

say "documentation"
RUSTDOCFLAGS=-Dwarnings cargo doc --workspace --no-deps --locked

say "tests"
cargo test --workspace --locked --profile checked

say "fuzzing the decoders for ${IMPROMPTU_FUZZ_SECONDS:=20} s"
cargo fuzz --version >/dev/null 2>&1 || cargo install --locked cargo-fuzz || fail "cargo-fuzz is missing; run: cargo install cargo-fuzz"
# Half of the time for each. Without a sanitizer the toolchain need not be a nightly one. In safe Rust a read out of bounds is a panic,
# an overflow too (cargo-fuzz turns the checks on).
# fuzz DECODER LENGTH SEEDS...
fuzz() {
    decoder=$1 length=$2
    shift 2
    mkdir -p "tests/fuzz/corpus/$decoder"
    cargo fuzz run --fuzz-dir tests/fuzz --sanitizer none "$decoder" "tests/fuzz/corpus/$decoder" "$@" -- \
        -max_total_time=$(((IMPROMPTU_FUZZ_SECONDS + 1) / 2)) -max_len="$length" -print_final_stats=1
}
fuzz decoder 4096 tests/golden/models
fuzz link 1024

printf '\nEverything passed.\n'
