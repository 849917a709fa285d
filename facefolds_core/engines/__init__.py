"""Assets for engines that cannot read them as they are."""
