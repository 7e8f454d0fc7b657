"""What lives on the graphics device: context, framebuffers, textures, actor models, the atlas of sign faces."""
