#!/bin/sh
# Builds the library for C programs: libimpromptu.a, in which nothing but impromptu_* is global.
#
# What cargo makes holds the compiler's own functions too (memcpy, and on microcontrollers arithmetic in double precision and a
# part of the mathematics). Linked into a firmware they take the place of its own. So what the library uses is made one object,
# whose other symbols are local. The linker and objcopy that rustc brings do it, for every target.
#
# usage: firmware/c-abi/library.sh [TARGET] [OUTPUT]
#   TARGET  as rustc names it, for example thumbv7em-none-eabihf; this machine if none is given
#   OUTPUT  FILE.a, or FILE.o for a linker that wants an object; TARGETFOLDER/TARGET/impromptu/libimpromptu.a if none is given
# The folder for what is built is cargo's: CARGO_TARGET_DIR is honoured. The path of the library is printed.
set -eu
fail() { echo "library.sh: $1" >&2; exit 1; }

folder=$(cd "$(dirname "$0")" && pwd)
command -v cargo > /dev/null || fail "cargo is not installed; see https://rustup.rs"
host=$(cd "$folder" && rustc -vV | sed -n 's/^host: //p')
target=${1:-$host}
case ${2:-x.a} in
    *.a | *.o) ;;
    *) fail "$2 is neither a library (.a) nor an object (.o)" ;;
esac
output=${2:+$(realpath -m "$2")}
built=${CARGO_TARGET_DIR:+$(realpath -m "$CARGO_TARGET_DIR")}

# What rust-toolchain.toml names is what counts.
cd "$folder"
[ -d "$(rustc --print sysroot)/lib/rustlib/$target" ] || fail "rustc has no $target; run: rustup target add $target"
built=${built:-$(cargo metadata --format-version 1 --no-deps --locked | sed -n 's/.*"target_directory":"\([^"]*\)".*/\1/p')}
output=${output:-$built/$target/impromptu/libimpromptu.a}
archive=$built/$target/firmware/libimpromptu.a

programs=$(rustc --print sysroot)/lib/rustlib/$host/bin
release=$(rustc -vV | sed -n 's/^release: //p')
[ -x "$programs/rust-lld" ] || fail "$programs/rust-lld is missing; run: rustup toolchain install $release"
# Not all of rustc's packages find their own shared libraries.
LD_LIBRARY_PATH="$(rustc --print sysroot)/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
export LD_LIBRARY_PATH
objcopy=
for candidate in "$programs/rust-objcopy" llvm-objcopy; do
    "$candidate" --version > /dev/null 2>&1 && objcopy=$candidate && break
done
[ -n "$objcopy" ] || fail "llvm-objcopy is missing; run: sudo apt-get install llvm"

cargo build --quiet --package impromptu-c-abi --profile firmware --target "$target" --target-dir "$built" --locked

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
names=$(sed -n 's/^[a-z][^(]*[ *]\(impromptu_[a-z_]*\)(.*/\1/p' include/impromptu.h)
# shellcheck disable=SC2046 # a flag and a name each
"$programs/rust-lld" -flavor gnu -r --gc-sections -z noexecstack $(printf -- '-u %s ' $names) "$archive" -o "$work/whole.o"
"$objcopy" --wildcard '--keep-global-symbol=impromptu_*' --strip-debug --remove-section=.llvmbc --remove-section=.llvmcmd \
    "$work/whole.o" "$work/impromptu.o"
mkdir -p "$(dirname "$output")"
case $output in
    *.o) cp "$work/impromptu.o" "$output" ;;
    *)
        # An archive of one object: what a linker takes, with the index that makes it look into it.
        rm -f "$output"
        command -v "${AR:-ar}" > /dev/null || fail "${AR:-ar} is not installed; run: sudo apt-get install binutils"
        "${AR:-ar}" rcs "$output" "$work/impromptu.o"
        ;;
esac
echo "$output"
