"""The commands: one file each, by its name; ``nsspice serve-mcp`` is in ``serve_mcp``.

``app`` imports a file when its command is called.  Read ``run`` first, the longest one.  Imports
the shared files of the command line and everything below it.
"""
