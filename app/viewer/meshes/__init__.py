"""Meshes of real arms: from a zip that a visitor sends, or from an installed package of robot descriptions.

A zip may be hostile. The archive is checked here before anything is unpacked; meshes are parsed by a
process of their own with little memory and time (`child`), because the loaders of mesh formats are not made for
hostile input. No file outside the archive is opened, and nothing is fetched.
"""
