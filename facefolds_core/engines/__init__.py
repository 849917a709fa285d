"""Exporters: each module of this package writes an asset as a program can read it, named as `facefolds export` has it.

A module has

    def export(out: Path, level: AssetLevel, subject: str) -> str

which writes the file or folder `out`, whole or not at all, and returns what it wrote in words, or raises `UserError`.
The first line of its docstring is its help.
"""
