"""Programs and pages of a service with several processes: each program gets to its page, wherever it arrives."""

from __future__ import annotations

import json
import re
from contextlib import ExitStack

import numpy as np
import pytest
from attacks import victim
from fake_browser import FakeBrowser
from websockets.sync.client import connect

import kin
from app.live import home_of
from app.live.client import RefusedError
from app.service.handover import SUPPORTED

pytestmark = [pytest.mark.skipif(not SUPPORTED, reason="one process on this system"), pytest.mark.full]
Q = np.array([1.0, 0.5, 0.5, 0.5, 0.5])  # of the first arm


def test_each_program_and_channel_gets_to_its_page_and_no_other_request_goes_astray():
    arm = kin.get_robot("pioneer5")
    with victim(ready=True, KINBOARD_WORKERS="2", KINBOARD_TOKEN="very secret") as service, ExitStack() as stack:
        token = {"Authorization": "Bearer very secret"}
        url, homes = f"http://127.0.0.1:{service.port}", set()
        for k in range(20):  # both workers have some
            page = stack.enter_context(FakeBrowser(service.port, additional_headers=token, proxy=None))
            page.wait(
                lambda page=page: any(m["props"].get("label") == "Connect a program" for m in page.gui.values())
            )
            page.send("GuiUpdateMessage", uuid=page.element("Connect a program"), updates={"value": True})
            page.wait(lambda page=page: "data-live-code" in page.html)
            page.say("axes")
            page.wait(lambda page=page: page.value("Arrows along") == "Base axes")
            code = re.findall(r"data-live-code>([A-Z0-9-]+)<", page.html)[0]
            homes.add(home_of(code, 2))
            q = Q + 0.001 * k
            for _ in range(4):  # several connections: of a program's, too, the kernel chooses the process
                with kin.connect(url, code, token="very secret") as program:
                    program.q = q
            T = kin.fk(arm, q)
            page.wait(lambda page=page, T=T: bool(np.allclose(page.tool_pose(), T, atol=1e-5)))
            if len(homes) == 2 and k >= 3:
                break
        assert homes == {0, 1}
        with pytest.raises(RefusedError, match="access token"):
            kin.connect(url, code)
        with pytest.raises(RefusedError, match="No page has the code"):
            kin.connect(url, "ACDE-FGHJ", token="very secret")
        stream = f"ws://127.0.0.1:{service.port}/api/v1/robots/pioneer5/workspace/stream?n=10"
        with connect(stream, proxy=None, additional_headers=token) as cloud:
            assert json.loads(cloud.recv(10))["type"] == "start"
    assert "Traceback" not in service.log
