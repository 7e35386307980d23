#!/bin/sh
# Whether the firmware that was linked in a folder calls what was wrapped: else the commander's planner is never seen, and
# nothing would be corrected.
# usage: check.sh FOLDER NAME...
set -eu
folder=$1
shift
# shellcheck disable=SC2012 # names of our own make file
elf=$(ls -t "$folder"/*.elf 2> /dev/null | head -n 1)
[ -n "$elf" ] || { echo "check.sh: there is no firmware in $folder" >&2; exit 1; }
symbols=$("${CROSS_COMPILE-arm-none-eabi-}nm" "$elf")
for name in "$@"; do
    case $symbols in
        *" T __wrap_$name"*) ;;
        *)
            echo "check.sh: the commander of this firmware does not call $name any more: its plan cannot be corrected" >&2
            rm -f "$folder"/*.bin "$folder"/*.hex
            exit 1
            ;;
    esac
done
