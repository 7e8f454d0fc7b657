"""Makes a release: everything but the upload."""
