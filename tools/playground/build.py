"""What the playground of the site is made of, from packages alone: `make playground`.

1. The core for wasm32-unknown-emscripten, by Debian's Rust for browsers, which is unpacked and not
   installed, and by cargo.  Python and C's library come from Pyodide when the module is loaded.
2. A wheel of it with the package, and the parser's package.
3. Pyodide and the editor, from npm.

The files go to `build/playground`, from where the site's build takes them.
"""

from __future__ import annotations

import base64
import hashlib
import json
import os
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Mapping
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
OUT = ROOT / "build" / "playground"
CACHE = ROOT / ".cache" / "playground"
TARGET = "wasm32-unknown-emscripten"
#: Rust that can compile its own standard library for a browser, its code generator and a linker
DEBIAN = (
    "rustc-web",
    "libstd-rust-web-1.96",
    "libstd-rust-web-dev",
    "libllvm22",
    "rust-web-src",
    "rust-web-llvm",
    "lld-22",
    "libclang-common-22-dev",
)
#: files of Pyodide that a browser loads
PYODIDE = (
    "pyodide.mjs",
    "pyodide.asm.mjs",
    "pyodide.asm.wasm",
    "python_stdlib.zip",
    "pyodide-lock.json",
)


def run(*command: str | Path, cwd: Path = ROOT, env: Mapping[str, str] | None = None) -> None:
    """Run a command that must succeed."""
    subprocess.run([*map(str, command)], cwd=cwd, check=True, env={**os.environ, **(env or {})})


def lacking() -> list[str]:
    """Return what this machine lacks, a sentence each."""
    programs = {
        "apt-get": "the compiler comes from Debian's packages, of bookworm's security updates",
        "dpkg": "it unpacks them",
        "cargo": "install Rust by rustup",
        "npm": "apt install npm",
    }
    return [f"{name} is missing: {why}" for name, why in programs.items() if not shutil.which(name)]


def toolchain() -> Path:
    """Return the folder of the unpacked compiler."""
    root = CACHE / "rust"
    home = root / "usr"
    if not (home / "bin" / "rustc").exists():
        packages = CACHE / "debian"
        packages.mkdir(parents=True, exist_ok=True)
        run("apt-get", "-q", "download", *DEBIAN, cwd=packages)
        for package in sorted(packages.glob("*.deb")):
            run("dpkg", "-x", package, root)
    # cargo looks for the sources of the standard library here
    sources = home / "lib" / "rustlib" / "src" / "rust"
    if not sources.exists():
        sources.parent.mkdir(parents=True, exist_ok=True)
        (origin,) = (home / "src").glob("rustc-*")
        sources.unlink(missing_ok=True)
        sources.symlink_to(origin)
    return home


def core(home: Path) -> Path:
    """Compile the core, and return its module."""
    target = CACHE / "target"
    env = {
        "LD_LIBRARY_PATH": f"{home / 'lib' / 'x86_64-linux-gnu'}:{home / 'lib'}",
        "RUSTC": str(home / "bin" / "rustc"),
        "RUSTC_BOOTSTRAP": "1",  # the standard library is compiled, too
        "RUSTFLAGS": "-C relocation-model=pic -Z link-native-libraries=no",
        "PYO3_CROSS": "1",
        "WASM_LD": str(home / "bin" / "wasm-ld-22"),
        f"CARGO_TARGET_{TARGET.upper().replace('-', '_')}_LINKER": str(HERE / "link.py"),
        "CARGO_TARGET_DIR": str(target),
        "CARGO_PROFILE_RELEASE_PANIC": "abort",
        "CARGO_PROFILE_RELEASE_OPT_LEVEL": "1",  # 5 minutes of CPU, 12 MB
        "CARGO_PROFILE_RELEASE_LTO": "off",
        "CARGO_PROFILE_RELEASE_CODEGEN_UNITS": "16",
    }
    run(
        "cargo", "build", "--release", "--locked", "--lib", "--features", "extension-module",
        "-Zbuild-std=std,panic_abort", "--target", TARGET,
        "--manifest-path", ROOT / "nsspice" / "core" / "Cargo.toml",
        env=env,
    )  # fmt: skip
    return target / TARGET / "release" / "_core.wasm"


def version() -> str:
    """Return the version of the package."""
    manifest = (ROOT / "nsspice" / "core" / "Cargo.toml").read_text("utf-8")
    return manifest.partition('\nversion = "')[2].partition('"')[0]


def wheel(module: Path, abi: str) -> Path:
    """Write the wheel of the package with a compiled core, for an interface of Pyodide."""
    tag = f"cp310-abi3-pyemscripten_{abi}_wasm32"
    info = f"nsspice-{version()}.dist-info"
    path = OUT / f"nsspice-{version()}-{tag}.whl"
    contents = {"nsspice/_core.abi3.so": module.read_bytes()}
    package = ROOT / "nsspice"
    for folder in (package, package / "netlists"):  # a link, which glob does not follow
        for file in sorted(folder.rglob("*")):
            name = f"nsspice/{file.relative_to(package)}"
            if file.is_file() and not name.startswith("nsspice/core/") and is_needed(file):
                contents[name] = file.read_bytes()
    meta = f"Metadata-Version: 2.1\nName: nsspice\nVersion: {version()}\n"
    contents[f"{info}/METADATA"] = meta.encode()
    contents[f"{info}/WHEEL"] = f"Wheel-Version: 1.0\nRoot-Is-Purelib: false\nTag: {tag}\n".encode()
    contents[f"{info}/RECORD"] = record(contents, f"{info}/RECORD").encode()
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents.items():
            archive.writestr(name, content)
    return path


def is_needed(file: Path) -> bool:
    """Return whether a file of the package goes into the wheel: no expected results of netlists."""
    left_out = {".so", ".pyc", ".pyi", ".toml", ".csv", ".md"}
    return "__pycache__" not in file.parts and file.suffix not in left_out


def record(contents: Mapping[str, bytes], own: str) -> str:
    """Return the list of files with their hashes that a wheel has."""
    rows = []
    for name, content in contents.items():
        hashed = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        rows.append(f"{name},sha256={hashed},{len(content)}")
    return "\n".join([*rows, f"{own},,", ""])


def web() -> Path:
    """Install what comes from npm, bundle the editor, and return the folder of Pyodide."""
    folder = CACHE / "npm"
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("package.json", "editor.js"):
        shutil.copy(HERE / name, folder / name)
    run("npm", "install", "--no-audit", "--no-fund", "--silent", cwd=folder)
    run(
        folder / "node_modules" / ".bin" / "esbuild", "editor.js", "--bundle", "--minify",
        "--format=esm", "--log-level=warning", f"--outfile={OUT / 'editor.min.js'}",
        cwd=folder,
    )  # fmt: skip
    return folder / "node_modules" / "pyodide"


def parser() -> Path:
    """Fetch the package of the parser, which is pure Python."""
    pip = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps"]
    run(*pip, "--only-binary=:all:", "--dest", OUT, "lark")
    (path,) = OUT.glob("lark-*.whl")
    return path


def main() -> int:
    """Build everything, or say what is missing."""
    found = lacking()
    try:
        if not found:
            build()
    except subprocess.CalledProcessError as error:
        found = [f"this failed: {' '.join(map(str, error.cmd))}"]
        if error.cmd[0] == "apt-get":
            found.append("apt-get update first; the packages are those of Debian bookworm (amd64)")
    if found:
        print("the playground cannot be built here:", *found, sep="\n  ", file=sys.stderr)
    return 1 if found else 0


def build() -> None:
    """Build everything."""
    shutil.rmtree(OUT, ignore_errors=True)
    OUT.mkdir(parents=True)
    pyodide = web()
    (OUT / "pyodide").mkdir()
    for name in PYODIDE:
        shutil.copy(pyodide / name, OUT / "pyodide" / name)
    lock = json.loads((pyodide / "pyodide-lock.json").read_text("utf-8"))
    release = json.loads((pyodide / "package.json").read_text("utf-8"))["version"]
    wheels = [wheel(core(toolchain()), lock["info"]["abi_version"]), parser()]
    runtime = {
        # numpy and scipy for this interface are nowhere else
        "packages": f"https://cdn.jsdelivr.net/pyodide/v{release}/full/",
        "wheels": [path.name for path in wheels],
    }
    (OUT / "runtime.json").write_text(json.dumps(runtime, indent=1) + "\n", "utf-8")
    for path in sorted(OUT.rglob("*")):
        if path.is_file():
            print(f"{path.stat().st_size:>10} {path.relative_to(ROOT)}")


if __name__ == "__main__":
    sys.exit(main())
