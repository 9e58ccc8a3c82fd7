"""Bodies that look like the real arms: one file ``<robot id>.toml`` in this folder draws one built-in arm."""
