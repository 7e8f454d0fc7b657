"""How well the right passages are found: labelled questions of the packs, against simpler rankings in the same run."""
