"""The API: what `import facefolds_core as facefolds` offers. A thin layer over the stages' own functions.

Every step writes its parameters and does what its stage does (pipeline/), in a folder of work that is laid out as data/
is: a temporary one, or one that the caller names. So the commands `facefolds ...` and `python -m stages.NAME` go on
where the API stops, and the reverse.
"""
