"""MJCF files, MuJoCo's own format: written with bodies and assumed masses, and read as serial arms."""
