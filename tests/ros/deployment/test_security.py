"""DDS security: a node that is to be secured never starts without security.

The Fast DDS of the wheels is built without security (docs/security.md), so that nothing can be
authenticated here. This tests what users of the wheels rely on: the planner does not start, rather
than starting open to all participants. Where the test fails because a planner started, the wheels
have security: then test that a participant without a certificate gets nothing.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from conftest import Site

FILES = (
    "identity_ca.cert.pem",
    "cert.pem",
    "key.pem",
    "permissions_ca.cert.pem",
    "governance.p7s",
    "permissions.p7s",
)


@pytest.fixture
def keystore(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A keystore, named in the environment; its files are empty, since they are not read."""
    enclave = tmp_path / "keystore" / "enclaves" / "planner"
    enclave.mkdir(parents=True)
    for name in FILES:
        (enclave / name).touch()
    monkeypatch.setenv("ROS_SECURITY_KEYSTORE", str(tmp_path / "keystore"))
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    return enclave


@pytest.mark.parametrize("strategy", ["Enforce", "Permissive"])
def test_planner_with_an_enclave_does_not_come_up_open(
    strategy: str, keystore: Path, site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", strategy)
    planner = site.start("planner_node", "--ros-args", "--enclave", "/planner")
    assert planner.popen.wait(60.0) != 0
    log = planner.log.read_text()
    assert str(keystore) in log
    assert "doesn't have the security libraries" in log


def test_planner_without_its_enclave_does_not_come_up(
    keystore: Path, site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Enforce")
    planner = site.start("planner_node", "--ros-args", "--enclave", "/another")
    assert planner.popen.wait(60.0) != 0
    assert "/another" in planner.log.read_text()
