#!/bin/sh
# Installs what is missing, then checks and tests, and says at the end what took how long.
# Stops at the first failure and says which step it was. Needs only Rust (https://rustup.rs) on Debian or Ubuntu.
# usage: tests/run.sh        everything, the emulated microcontroller included
#        tests/run.sh fast   format, lints and unit tests
#        tests/run.sh long   what is too long for everything: whole tables, fuzzing for minutes
# IMPROMPTU_FUZZ_SECONDS: how long is fuzzed, all targets together (20; long: 600)
# PROPTEST_RNG_SEED: what the cases of property tests are drawn from (1; long: the time)
set -eu
cd "$(dirname "$0")/.."
tier=${1:-all}
case $tier in all | fast | long) ;; *) sed -n 's/^# usage: /usage: /p; s/^#        / /p' "$0" >&2; exit 2 ;; esac
target=thumbv7em-none-eabihf
# Where the firmware, C and other programs are built; the tests use the same folder.
out=${CARGO_TARGET_DIR:-target}
firmware=$out/firmware
# Cargo workspaces apart from the main one.
workspaces="tests/fuzz tests/peers"
# Bare targets that the libraries are checked for.
libraries="impromptu-firmware impromptu-flight"
bare="thumbv6m-none-eabi thumbv7m-none-eabi thumbv7em-none-eabi thumbv7em-none-eabihf thumbv8m.main-none-eabi
thumbv8m.main-none-eabihf riscv32imac-unknown-none-elf wasm32-unknown-unknown"
# Systems that the host's programs are checked for.
systems="x86_64-pc-windows-gnu aarch64-apple-darwin"
oldest=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)

# What took how long: a line "SECONDS fresh|every NAME" for each step that is over.
times=
step=start kind=every began=$(date +%s) notes=
over() {
    now=$(date +%s)
    [ "$step" = start ] || times="$times$((now - began)) $kind $step
"
    began=$now
}
# Begins a step.
say() { over; step=$1 kind=every; printf '\n== %s\n' "$1"; }
# Begins a step that only a fresh machine pays: the installation of a tool.
fresh() { over; step=$1 kind=fresh; printf '\n== %s\n' "$1"; }
# Said once more at the end.
note() { printf '%s\n' "$1"; notes="$notes$1
"; }
summary() {
    over
    printf '\n== what took how long\n'
    printf '%s' "$times" | awk '
        function clock(seconds) { return sprintf("%3d:%02d", seconds / 60, seconds % 60) }
        { seconds = $1; kind = $2; $1 = $2 = ""; sub(/^ +/, "") }
        kind == "fresh" { fresh += seconds; installed = installed clock(seconds) "  " $0 "\n"; next }
        { every += seconds; print clock(seconds) "  " $0 }
        END {
            print clock(every) "  together"
            if (installed) printf "\nand only on a fresh machine\n%s%s  together\n", installed, clock(fresh)
        }'
    [ -z "$notes" ] || printf '\n%s' "$notes"
}
fail() { printf '\ntests/run.sh: FAILED: %s\n' "$1" >&2; trap - EXIT; summary; exit 1; }
trap 'code=$?; [ $code -eq 0 ] || { summary; printf "\ntests/run.sh: FAILED at: %s\n" "$step" >&2; }; exit $code' EXIT
has() { command -v "$1" >/dev/null 2>&1; }

# Runs a command as root.
as_root() {
    if [ "$(id -u)" -eq 0 ]; then "$@"; else has sudo || fail "run as root: $*"; sudo "$@"; fi
}

# Installs distribution packages, or says how: install PACKAGES OTHERWISE
install() {
    fresh "packages: $1"
    has apt-get || fail "$1 is missing; ${2:-install it}"
    as_root apt-get update --quiet || true
    # shellcheck disable=SC2086 # a list of packages
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends $1 ||
        fail "this did not work: sudo apt-get install $1"
}

# Installs a program of Cargo's, or says how: tool NAME
tool() {
    ! has "$1" || return 0
    fresh "cargo install $1"
    cargo install --locked "$1" || fail "$1 is missing; run: cargo install --locked $1"
}

say "tools"
# cc also builds the cycle model of `cargo mcu`, a plugin of QEMU; it needs no header of QEMU.
has cc || install "gcc libc6-dev" "macOS: run xcode-select --install"
if [ "$tier" != fast ]; then
    has c++ || install "g++ libc6-dev" "macOS: run xcode-select --install"
    has qemu-system-arm || install qemu-system-arm "macOS: run brew install qemu"
    has arm-none-eabi-gcc ||
        install "gcc-arm-none-eabi libnewlib-arm-none-eabi" "macOS: run brew install --cask gcc-arm-embedded"
fi
has cargo && has rustc || fail "Rust is missing; install it from https://rustup.rs"
rustc --version
version=$(rustc --version | cut -d' ' -f2)
[ "$(printf '%s\n%s\n' "$oldest" "$version" | sort -V | head -n 1)" = "$oldest" ] ||
    fail "Rust $version is older than $oldest; run: rustup update stable"
# Flags from outside would change what is built, above all for the microcontroller (.cargo/config.toml).
unset RUSTFLAGS RUSTDOCFLAGS CARGO_BUILD_TARGET
[ -n "${PROPTEST_RNG_SEED:-}" ] || { [ "$tier" = long ] && PROPTEST_RNG_SEED=$(date +%s) || PROPTEST_RNG_SEED=1; }
export PROPTEST_RNG_SEED
echo "property tests with PROPTEST_RNG_SEED=$PROPTEST_RNG_SEED"

for component in rustfmt clippy; do
    cargo "$(echo $component | sed 's/rustfmt/fmt/')" --version >/dev/null 2>&1 ||
        { fresh "rustup component add $component" && has rustup && rustup component add $component; } ||
        fail "$component is missing; run: rustup component add $component"
done

has_target() { [ -d "$(rustc --print target-libdir --target "$1")" ]; }
# Adds a target, or says how.
add_target() {
    ! has_target "$1" || return 0
    fresh "rustup target add $1"
    { has rustup && rustup target add "$1"; } || fail "the target $1 is missing; run: rustup target add $1"
}
# The microcontroller's target, from rustup or out of the distribution's packages.
add_thumb() {
    [ -z "${IMPROMPTU_THUMB_TOOLCHAIN:-}" ] && ! has_target $target || return 0
    fresh "target $target"
    if has rustup && rustup target add $target; then return 0; fi
    echo "rustup cannot add it: making it from the distribution's packages"
    IMPROMPTU_THUMB_TOOLCHAIN=$PWD/target/thumb-toolchain
    [ -x "$IMPROMPTU_THUMB_TOOLCHAIN/bin/cargo" ] || {
        has apt-get || fail "the target $target is missing; run: rustup target add $target"
        as_root apt-get update --quiet || true
        install "$(tests/thumb-toolchain.sh --packages)"
        tests/thumb-toolchain.sh "$IMPROMPTU_THUMB_TOOLCHAIN"
    }
    export IMPROMPTU_THUMB_TOOLCHAIN
    note "The microcontroller's code is built by another compiler than rust-toolchain.toml names: golden counts will differ."
}
# cargo of the toolchain that has the microcontroller's target.
cross() {
    [ -z "${IMPROMPTU_THUMB_TOOLCHAIN:-}" ] || PATH=$IMPROMPTU_THUMB_TOOLCHAIN/bin:$PATH
    cargo "$@"
}
# `--package NAME` for each name, `--target NAME` for each.
packages() { for name in "$@"; do printf -- '--package %s ' "$name"; done; }
targets() { for name in "$@"; do printf -- '--target %s ' "$name"; done; }

formatting() {
    say "formatting"
    cargo fmt --all --check || fail "formatting; run: cargo fmt --all"
    for workspace in $workspaces; do
        cargo fmt --all --manifest-path $workspace/Cargo.toml --check ||
            fail "formatting; run: cargo fmt --all --manifest-path $workspace/Cargo.toml"
    done
}

locks() {
    say "locked versions"
    # Nothing is downloaded but the index.
    for workspace in . $workspaces; do
        cargo update --quiet --workspace --locked --manifest-path $workspace/Cargo.toml ||
            fail "$workspace/Cargo.lock is not up to date; run: cargo update --workspace --manifest-path $workspace/Cargo.toml"
    done
}

lints() {
    # Among them incompatible_msrv: nothing of the standard library that Rust $oldest lacks.
    say "clippy"
    cargo clippy --workspace --all-targets --locked -- -D warnings
}

board_lints() {
    add_thumb
    say "clippy, microcontroller"
    # shellcheck disable=SC2086 # flags
    {
        flags="--bins --locked --target $target --target-dir $firmware"
        (cross clippy $(packages $libraries impromptu-c-abi impromptu-planted impromptu-twins) --lib $flags --profile firmware \
            -- -D warnings)
        (cross clippy --package impromptu-board --lib $flags --profile board -- -D warnings)
        (cross clippy --manifest-path tests/peers/Cargo.toml --package impromptu-mcu-benchmark $flags --profile firmware \
            -- -D warnings)
    }
}

bare_targets() {
    for name in $bare; do [ $name = $target ] || add_target $name; done
    add_thumb
    say "libraries on bare targets"
    # shellcheck disable=SC2046,SC2086 # flags
    {
        cargo check $(packages $libraries) $(targets $(echo "$bare" | tr ' ' '\n' | grep -vx $target)) --locked
        (cross check $(packages $libraries) --target $target --locked)
        (cross check --package impromptu-firmware --features defmt,serde,signed --target $target --locked)
    }
}

other_systems() {
    for name in $systems wasm32-unknown-unknown; do add_target $name; done
    say "programs on Windows and macOS"
    # shellcheck disable=SC2046,SC2086 # flags
    cargo check --package impromptu-host-sim --package impromptu-model-export $(targets $systems) --locked
    say "simulator in the browser"
    cargo check --package impromptu-sim --no-default-features --target wasm32-unknown-unknown --locked
}

dependencies() {
    tool cargo-deny
    say "licences, sources, duplicate versions"
    cargo deny --log-level warn --locked check licenses sources bans ||
        fail "see .cargo/deny.toml, which lists what is allowed and why"
}

# A real build where that toolchain can be had; the lint on the standard library has been applied in any case.
oldest_rust() {
    if has rustup && ! rustup run "$oldest.0" rustc --version >/dev/null 2>&1; then
        fresh "rustup toolchain install $oldest.0"
        rustup toolchain install "$oldest.0" --profile minimal --no-self-update || true
    fi
    say "oldest Rust, $oldest"
    if has rustup && rustup run "$oldest.0" rustc --version; then
        # shellcheck disable=SC2046,SC2086 # flags
        cargo "+$oldest.0" check $(packages $libraries impromptu-model-export impromptu-diagnosis) --locked
    else
        note "Rust $oldest cannot be had here: that it builds the libraries is proved by clippy's incompatible_msrv alone."
    fi
}

documentation() {
    say "documentation"
    RUSTDOCFLAGS=-Dwarnings cargo doc --workspace --no-deps --locked
}

crates() {
    say "packages as they are published"
    tests/packages.sh
}

# Those of the reproduction are whole studies, which take minutes.
unit_tests() {
    say "unit tests"
    cargo test --workspace --exclude impromptu-reproduction --lib --bins --locked --profile checked
    say "lines, files, packages"
    cargo test --package impromptu-tests --test tidy --locked --profile checked
}

all_tests() {
    say "tests"
    cargo test --workspace --locked --profile checked
    say "signed models"
    cargo test --package impromptu-firmware --features signed --test storage --locked --profile checked
}

long_tests() {
    say "long tests"
    cargo test --workspace --locked --profile checked -- --ignored long_
    say "generated cases, sixteen times as many"
    PROPTEST_CASES=4096 cargo test --workspace --lib --tests --exclude impromptu-tests --locked --profile checked
}

# They are measured by hand (README.md); here only that they build.
other_simulators() {
    has cmake || install cmake "macOS: run brew install cmake"
    has git || install git
    say "other simulators"
    cargo check --manifest-path tests/peers/Cargo.toml --package impromptu-plant-benchmark --benches --locked
}

# A fifth of the time for each. Without a sanitizer the toolchain need not be a nightly one. In safe Rust a read out of bounds
# is a panic, an overflow too (cargo-fuzz turns the checks on).
# fuzz TARGET LENGTH SEEDS...
fuzz() {
    fuzzed=$1 length=$2
    shift 2
    mkdir -p "tests/fuzz/corpus/$fuzzed"
    cargo fuzz run --fuzz-dir tests/fuzz --sanitizer none "$fuzzed" "tests/fuzz/corpus/$fuzzed" "$@" -- \
        -max_total_time=$(((IMPROMPTU_FUZZ_SECONDS + 4) / 5)) -max_len="$length" -print_final_stats=1
}
# fuzzing SECONDS
fuzzing() {
    tool cargo-fuzz
    IMPROMPTU_FUZZ_SECONDS=${IMPROMPTU_FUZZ_SECONDS:-$1}
    say "fuzzing for $IMPROMPTU_FUZZ_SECONDS s"
    fuzz decoder 4096 tests/golden/models
    fuzz link 1024
    fuzz calls 2048
    fuzz settings 2048
    fuzz description 4096
}

case $tier in
fast)
    formatting
    locks
    lints
    unit_tests
    ;;
all)
    formatting
    locks
    lints
    board_lints
    bare_targets
    other_systems
    dependencies
    oldest_rust
    documentation
    crates
    all_tests
    fuzzing 20
    ;;
long)
    add_thumb
    long_tests
    other_simulators
    fuzzing 600
    ;;
esac

summary
printf '\nEverything passed.\n'
