#!/bin/sh
# Makes a toolchain with the microcontroller's target out of Debian's or Ubuntu's packages, where rustup cannot provide it.
# It is not linked anywhere: the tests find it through IMPROMPTU_THUMB_TOOLCHAIN. About 30 s and 60 MB, once.
# usage: tests/thumb-toolchain.sh FOLDER     makes it
#        tests/thumb-toolchain.sh --packages lists the packages that must be installed before
set -eu
# The linker belongs to the compiler's LLVM, whose version stands only in the packages' dependencies.
llvm=$(apt-cache depends rust-web-llvm | sed -n 's/.*Depends: llvm-\([0-9]*\)$/\1/p')
packages="rustc-web cargo-web rust-web-src rust-web-clippy lld-$llvm"
[ "${1:-}" != --packages ] || { echo "$packages"; exit; }
folder=$(realpath -m "${1:?usage: $0 FOLDER}")
target=thumbv7em-none-eabihf
source=/usr/lib/rustlib/src/rust

fail() { echo "thumb-toolchain: $1" >&2; exit 1; }
linker=/usr/lib/llvm-$llvm/bin/lld
for file in /usr/bin/rustc /usr/bin/cargo $source/library/core/src/lib.rs "$linker"; do
    [ -e "$file" ] || fail "$file is missing; run: sudo apt-get install $packages"
done

# `core` is compiled by the compiler that it belongs to; another version would refuse it.
host=$(/usr/bin/rustc -vV | sed -n 's/^host: //p')
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/src"
echo '#![no_std]' > "$work/src/lib.rs"
cat > "$work/Cargo.toml" <<'END'
[package]
name = "empty"
version = "0.0.0"
edition = "2021"
[workspace]
[profile.release]
debug = "line-tables-only"
codegen-units = 1
panic = "abort"
END
# Bit code is kept so that a link with whole-program optimisation can inline `core`; no local path gets into the binaries.
flags=$(printf '%s\037' -Cembed-bitcode=yes -Zforce-unstable-if-unmarked "--remap-path-prefix=$(readlink -f $source)=/rustc")
(
    cd "$work"
    unset RUSTFLAGS CARGO_BUILD_TARGET RUSTC_WRAPPER RUSTUP_TOOLCHAIN
    PATH=/usr/bin:$PATH RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 CARGO_ENCODED_RUSTFLAGS=${flags%?} \
        /usr/bin/cargo build --quiet --release --target-dir built -Zbuild-std=core,alloc --target $target
) || fail "the core library does not compile"

rm -rf "$folder"
mkdir -p "$folder/bin" "$folder/lib/rustlib/$target/lib" "$folder/lib/rustlib/$host/bin"
cp "$work/built/$target"/release/deps/lib*.rlib "$folder/lib/rustlib/$target/lib/"
rm -f "$folder/lib/rustlib/$target/lib"/libempty-*
ln -s /usr/lib/rustlib/$host/lib "$folder/lib/rustlib/$host/lib"
ln -s "$linker" "$folder/lib/rustlib/$host/bin/rust-lld"
for program in rustc rustdoc clippy-driver; do
    [ -x /usr/bin/$program ] || continue
    printf '#!/bin/sh\nexec /usr/bin/%s "$@" --sysroot "%s"\n' $program "$folder" > "$folder/bin/$program"
    chmod +x "$folder/bin/$program"
done
ln -s /usr/bin/cargo "$folder/bin/cargo"
# cargo-clippy starts the driver beside its real path, which takes the sysroot from this variable.
printf '#!/bin/sh\nSYSROOT="%s" exec /usr/bin/cargo-clippy "$@"\n' "$folder" > "$folder/bin/cargo-clippy"
chmod +x "$folder/bin/cargo-clippy"
echo "toolchain with $target: $folder"
