#!/bin/sh
# Packs every crate that is published, unpacks them, and checks them without the repository around them.
# usage: tests/packages.sh
# A crate is published if the table of the workspace's dependencies names its version beside its path.
set -eu
cd "$(dirname "$0")/.."
out=$(realpath -m "${CARGO_TARGET_DIR:-target}")
apart=$out/packages
published=$(sed -n 's/^\(impromptu-[a-z-]*\) = {.*path = "[^"]*".*version = .*/\1/p' Cargo.toml)
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
[ -n "$published" ] || { echo "no package in Cargo.toml has a version beside its path" >&2; exit 1; }

# shellcheck disable=SC2046 # flags
cargo package --quiet --no-verify --allow-dirty --locked $(for name in $published; do printf -- '--package %s ' "$name"; done)

rm -rf "$apart"
mkdir -p "$apart"
{
    echo '[workspace]'
    echo 'resolver = "3"'
    echo 'members = ['
    for name in $published; do echo "    \"$name-$version\","; done
    echo ']'
    # As in the repository, so that what is built of other crates is built once.
    echo '[profile.dev]'
    echo 'opt-level = 1'
    echo '[patch.crates-io]'
    for name in $published; do echo "$name = { path = \"$name-$version\" }"; done
} > "$apart/Cargo.toml"
cp Cargo.lock rust-toolchain.toml "$apart"
for name in $published; do
    tar -xzf "$out/package/$name-$version.crate" -C "$apart"
    for file in README.md CHANGELOG.md; do
        [ -e "$apart/$name-$version/$file" ] || { echo "$name has no $file" >&2; exit 1; }
    done
    echo "$name $version: $(find "$apart/$name-$version" -type f | wc -l) files"
done
# All packed files have one old time: what was checked of another version would be taken for them.
find "$apart" -name '*.rs' -exec touch {} +
CARGO_TARGET_DIR=$out cargo check --quiet --manifest-path "$apart/Cargo.toml" --workspace --tests --offline
echo "all of them check without the repository"
