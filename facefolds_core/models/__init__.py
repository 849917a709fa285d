"""The models that `train` fits, one module each: its keys, what is written of it, and what trains it.

A module's name is that of its model. It has

- `Params`, a `Section` whose key `model` is `Literal[NAME] = NAME`, with `preset`, `seed` and what else it needs;
- `PRESETS`: name -> the values that differ from the defaults;
- `spec()`: the pydantic model of `model.json`, with `kind: Literal[NAME] = NAME`;
- `build(spec)`: an untrained `RadianceManifolds`;
- `fit(scene, params, checkpoints, log)`: a `Trained`; and `train`, which writes files as well, if it
  looks after them itself (training/models.py).

Parameters are checked without torch, so a module imports no more than params at its top, and the rest within the
functions: a stage's digest counts what the functions that it calls import (source_code.py).
"""

import facefolds_core.params  # noqa: F401  (which imports the models: whoever comes first, they are whole)
