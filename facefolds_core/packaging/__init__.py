"""From what training and export made to the asset that ships: quality by target, levels, extras."""
