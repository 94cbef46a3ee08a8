"""What the firmware offers over the link: log blocks, parameters, memories, their tables of contents."""
