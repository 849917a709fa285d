"""One self-contained HTML page a subject, from the files that the pipeline left (docs/report.md)."""
