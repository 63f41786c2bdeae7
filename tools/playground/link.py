#!/usr/bin/env python3
"""Linker of the core for the browser, instead of emcc: objects and libraries to one side module.

A side module takes Python and C's library from the program that loads it, so that nothing of
emscripten is needed.  `WASM_LD` names the linker of LLVM.
"""

from __future__ import annotations

import os
import subprocess
import sys


def kept(arguments: list[str]) -> tuple[str, list[str]]:
    """Return the name of the module and the inputs among the arguments that rustc has for emcc."""
    inputs = [word for word in arguments if word.endswith((".o", ".rlib", ".a"))]
    return arguments[arguments.index("-o") + 1], inputs


def main() -> int:
    """Call the linker, and return its exit code."""
    output, inputs = kept(sys.argv[1:])
    flags = ["-shared", "--experimental-pic", "--no-entry", "--unresolved-symbols=import-dynamic"]
    flags += ["--gc-sections", "--export-if-defined=PyInit__core", "--no-demangle"]
    flags += ["-O2", "--strip-debug", "-o", output]
    return subprocess.run([os.environ["WASM_LD"], *flags, *inputs], check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
