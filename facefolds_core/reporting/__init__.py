"""One self-contained HTML page a subject, from the files that the pipeline left (docs/guide/report.md)."""
