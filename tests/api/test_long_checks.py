"""A check that takes long: hundreds of tests are designed for it."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from api.app import create_app
from api.settings import Settings
from tests.api.serving import serving

HOMOGENISED: dict[str, Any] = {
    "kind": "homogenised",
    "sample_rate": 1000.0,
    "period_samples": 4096,
    "periods": 3,
    "displacement": {
        "f_min": 0.25,
        "f_max": 15.0,
        "max_displacement": 0.02,
        "max_velocity": 0.4,
        "spectrum": "quarter-car",
    },
    "current": {"f_min": 0.25, "f_max": 50.0, "min": 0.3, "max": 1.6},
    "homogenise": {"method": "direct", "variables": ["velocity", "current"], "grid": [10, 10]},
}


@pytest.mark.slow
def test_orders_to_a_rig_do_not_wait_for_the_check_of_a_long_campaign(tmp_path: Path, body: dict[str, Any]) -> None:
    many = [{**HOMOGENISED, "name": f"test {seed}", "seed": seed} for seed in range(12)]  # each some 0.5 s
    app = create_app(Settings(data_dir=tmp_path / "lab"), with_workers=False)
    with serving(app) as client, ThreadPoolExecutor(1) as pool:
        rig = client.post("/v1/campaigns", json=body).json()["rig"]
        checked = pool.submit(client.post, "/v1/campaigns/check", json={**body, "tests": many}, timeout=600)
        answered = 0
        while not checked.done():
            assert client.post("/v1/rigs/resume", json={"rig": rig}).status_code == 200
            answered += 1
        assert answered > 5  # one that waits is answered when the check is
        assert checked.result().status_code == 200
