"""The stages: each takes a subject's folders, its parameters with them, and does its work from files to files.

DVC's commands (stages/) and the API (api/) call the same functions.
"""
