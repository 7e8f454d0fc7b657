"""Files that a stack needs: models and rulepacks, fetched and verified."""
