"""Visit a running service as programs and people do; used by image.sh.

python scripts/image_check.py URL PICTURE.png
"""

from __future__ import annotations

import json
import os
import sys
import urllib.request
from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import expect, sync_playwright

import kin

ARM = kin.get_robot("redundant7-craig")
CHROMIUM = os.environ.get("KINBOARD_TEST_CHROMIUM", "/usr/bin/chromium")
WAIT = 30_000  # ms; software rendering on a busy machine is slow


def main(url: str, picture: Path) -> None:
    check_rest(f"{url}/api/v1/robots/{ARM.id}")
    check_viewer(f"{url}/viewer/", picture)


def check_rest(arm: str) -> None:
    """The tool's pose is what the package computes, and the joint values found for it lead back there."""
    q = ARM.q_home + 0.1
    T = kin.fk(ARM, q)
    tool = ask(f"{arm}/fk", {"q": q.tolist()})["pose"]
    assert np.allclose(tool["position"], T[:3, 3], atol=1e-9), tool
    answer = ask(f"{arm}/ik", {"target": {"position": tool["position"], "wxyz": tool["wxyz"]}})
    assert answer["status"] == "solved", answer
    found = [kin.fk(ARM, np.array(solution["q"])) for solution in answer["solutions"]]
    assert np.allclose(found, T, atol=1e-9), answer
    print(f"FK and IK agree: {len(found)} solutions")


def ask(url: str, question: dict[str, object]) -> dict[str, object]:
    request = urllib.request.Request(url, json.dumps(question).encode(), {"Content-Type": "application/json"})
    straight = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    with straight.open(request, timeout=30) as answer:
        return json.load(answer)


def check_viewer(url: str, picture: Path) -> None:
    """Chromium shows an arm and its panel, without an error on the page."""
    errors: list[str] = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 720}, ignore_https_errors=True)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(url, timeout=WAIT)
        expect(page.locator("[data-status]")).to_have_attribute("data-status", "hand", timeout=WAIT)
        page.locator("[data-slow-close]").click()
        page.wait_for_timeout(2000)
        page.screenshot(path=picture)
        browser.close()
    assert errors == []
    with Image.open(picture) as image:
        colours = image.convert("RGB").crop((0, 0, 800, 720)).getcolors(1 << 20)
    assert colours is None or len(colours) > 200, "an empty scene"
    print("the viewer shows the arm")


if __name__ == "__main__":
    main(sys.argv[1].rstrip("/"), Path(sys.argv[2]))
