"""Files: read strictly, written whole or not at all; pictures, archives, frames; where a subject's data lies."""
