"""The lights of a scene: sky and two faint lamps for all arms, and one lamp with shadows for each arm.

viser's default lights cast three shadows of different sharpness, which leave stripes on horizontal faces. viser's
environment map is switched off: preparing it blocks the page for ten seconds or more on a machine without a
graphics card.
"""

from __future__ import annotations

import numpy as np
import viser

from app.viewer.scene.meshes import Body

# Directions to the lamps. The default camera looks from (0.80, 0.92, 0.46).
KEY = np.array([0.95, -0.15, 1.6])  # the lamp with shadows: above, on the left of the picture
FILL, RIM = (0.2, 1.0, 0.4), (-1.0, -0.6, 0.8)
FAR = 5.0  # distance of the lamp from the arm, in radii of the sphere around the arm
BEAM = 2.2  # half width of its beam at the arm, in radii: the arm and its shadow


def light_scene(scene: viser.SceneApi) -> None:
    """Add the lights that do not depend on the arm."""
    scene.configure_environment_map(None)
    scene.configure_default_lights(enabled=False)
    # viser leaves a light at the origin without a direction.
    scene.add_light_hemisphere(
        "/sky", sky_color=(255, 255, 255), ground_color=(132, 142, 164), intensity=1.9, position=(0.0, 0.0, 1.0)
    )
    scene.add_light_directional("/fill", color=(255, 246, 234), intensity=0.5, position=FILL)
    scene.add_light_directional("/rim", color=(214, 228, 255), intensity=1.0, position=RIM)


def add_lamp(scene: viser.SceneApi, name: str, body: Body) -> viser.SpotLightHandle:
    """Add the lamp that casts the shadows of one arm."""
    toward = KEY / float(np.linalg.norm(KEY))
    x, y, z = (-toward).tolist()
    return scene.add_light_spot(
        name,
        color=(255, 252, 246),
        intensity=2.9,
        angle=float(np.arctan(BEAM / FAR)),
        penumbra=0.6,
        decay=0.0,
        cast_shadow=True,
        direction=(x, y, z),
        position=tuple((body.center + toward * FAR * body.radius).tolist()),
    )
