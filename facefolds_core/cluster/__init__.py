"""Many subjects at once: plain DVC in folders of their own, handed out by Dask (docs/guide/clusters.md)."""
