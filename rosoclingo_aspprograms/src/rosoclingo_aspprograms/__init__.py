"""Checks what mailbots do, apart from any solver."""
