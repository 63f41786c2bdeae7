#!/bin/sh
# Make the ngspice shared library available: nothing if it is there, else the system's package
# manager.  usage: ngspice_library.sh PYTHON
python=${1:-python3}

found() { "$python" -c 'import ctypes.util, sys; sys.exit(not ctypes.util.find_library("ngspice"))'; }

as_root() {
    if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo -n "$@"; fi
}

found && exit 0
echo "ngspice's library is not installed; asking the package manager"
if command -v apt-get >/dev/null; then
    as_root apt-get install -y -q libngspice0 || { as_root apt-get update -q && as_root apt-get install -y -q libngspice0; }
elif command -v dnf >/dev/null; then
    as_root dnf install -y libngspice
elif command -v pacman >/dev/null; then
    as_root pacman -S --noconfirm ngspice
elif command -v brew >/dev/null; then
    brew install libngspice
fi

# Only the cross-checks against ngspice need it; they name the missing library themselves.
found || echo "warning: no ngspice library could be installed; on Debian: apt install libngspice0" >&2
exit 0
