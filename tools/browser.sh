#!/bin/sh
# Make a headless browser available, with which a report is opened in the tests: nothing if one is
# there, else the system's package manager.
found() {
    for name in chromium chromium-browser google-chrome chrome; do
        command -v "$name" >/dev/null && return 0
    done
    [ -x "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome" ]
}

as_root() {
    if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo -n "$@"; fi
}

found && exit 0
echo "no browser is installed; asking the package manager"
if command -v apt-get >/dev/null; then
    as_root apt-get install -y -q --no-install-recommends chromium ||
        { as_root apt-get update -q && as_root apt-get install -y -q --no-install-recommends chromium; }
elif command -v dnf >/dev/null; then
    as_root dnf install -y chromium
elif command -v pacman >/dev/null; then
    as_root pacman -S --noconfirm chromium
fi

found || echo "warning: no browser could be installed; on Debian: apt install chromium" >&2
exit 0
