#!/bin/sh
# Make ngspice's shared library and its code models (which come with the program) available: nothing
# if they are there, else the system's package manager.  usage: ngspice_library.sh PYTHON
python=${1:-python3}

found() {
    command -v ngspice >/dev/null &&
        "$python" -c 'import ctypes.util, sys; sys.exit(not ctypes.util.find_library("ngspice"))'
}

as_root() {
    if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo -n "$@"; fi
}

found && exit 0
echo "ngspice or its library is not installed; asking the package manager"
if command -v apt-get >/dev/null; then
    packages='ngspice libngspice0'
    as_root apt-get install -y -q $packages || { as_root apt-get update -q && as_root apt-get install -y -q $packages; }
elif command -v dnf >/dev/null; then
    as_root dnf install -y ngspice libngspice
elif command -v pacman >/dev/null; then
    as_root pacman -S --noconfirm ngspice
elif command -v brew >/dev/null; then
    brew install ngspice libngspice
fi

# Only the cross-checks against ngspice need it; they name the missing library themselves.
found || echo "warning: ngspice could not be installed; on Debian: apt install ngspice libngspice0" >&2
exit 0
