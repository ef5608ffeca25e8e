"""The page: one self-contained file that holds every state."""

from __future__ import annotations

import html.parser
import json
import re
from pathlib import Path

import numpy as np
import pytest

from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import ContactPlan, SurfaceEntry
from rbprm_core.view.page import POLICY, write_page
from rbprm_core.view.plan_geometry import load_plan_geometry


class Tags(html.parser.HTMLParser):
    """Collects the addresses and policies in a page, and the data of the plan."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.policies: list[str] = []
        self.data = ""
        self._in_data = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        named = dict(attrs)
        self.addresses += [str(named[key]) for key in ("src", "href", "data") if key in named]
        if named.get("http-equiv") == "Content-Security-Policy":
            self.policies.append(str(named["content"]))
        self._in_data = named.get("type") == "application/json"

    def handle_data(self, data: str) -> None:
        if self._in_data:
            self.data += data
            self._in_data = False


@pytest.fixture(scope="module")
def page(plan: ContactPlan, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("page") / "plan.html"
    write_page(plan, path)
    return path.read_text(encoding="utf-8")


def read_tags(page: str) -> Tags:
    tags = Tags()
    tags.feed(page)
    return tags


def test_nothing_is_fetched(page: str) -> None:
    tags = read_tags(page)
    assert tags.addresses == []
    assert tags.policies == [POLICY]
    assert "http" not in POLICY
    assert not re.search(r"""(src|href)\s*=\s*["']https?:|url\(\s*["']?https?:|@import""", page)


def test_size(page: str) -> None:
    assert len(page) < 12e6


def test_every_state_is_in_it(plan: ContactPlan, page: str) -> None:
    data = json.loads(read_tags(page).data)
    assert data["robustness"] == [state.robustness for state in plan.states]
    assert data["contacts"] == [[c.limb for c in state.contacts] for state in plan.states]
    assert data["threshold"] == plan.request.robustness_threshold
    assert np.allclose(data["roots"], [s.root.position for s in plan.states], atol=1e-4)


def test_names_cannot_break_the_page(plan: ContactPlan, tmp_path: Path) -> None:
    evil = "</script><img src=x>"
    robot = plan.robot.model_copy(update={"name": evil})
    states = tuple(
        s.model_copy(
            update={"contacts": tuple(c.model_copy(update={"limb": evil}) for c in s.contacts[:1])}
        )
        for s in plan.states
    )
    write_page(plan.model_copy(update={"robot": robot, "states": states}), tmp_path / "p.html")
    assert evil not in (tmp_path / "p.html").read_text(encoding="utf-8")


def test_bad_plan(bad_plan: ContactPlan, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput):
        write_page(bad_plan, tmp_path / "plan.html")


def test_no_such_folder(plan: ContactPlan, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="cannot be written"):
        write_page(plan, tmp_path / "none" / "plan.html")


def test_frames_meet_the_states(plan: ContactPlan) -> None:
    geometry = load_plan_geometry(plan)
    frames = geometry.interpolated(3)
    assert len(frames) == 3 * (len(plan.states) - 1) + 1
    assert np.allclose(frames[::3], geometry.configurations, atol=1e-9)


def test_contact_frames_stand_on_their_footprints(plan: ContactPlan) -> None:
    """The drawn ball of each foot touches its footprint."""
    geometry = load_plan_geometry(plan)
    placements = geometry.placements(geometry.configurations)
    for state, frames in zip(plan.states, placements, strict=True):
        for contact in state.contacts:
            index = next(i for i, link in enumerate(geometry.links) if link.limb == contact.limb)
            vertices = geometry.links[index].mesh.copy().apply_transform(frames[index]).vertices
            gap = np.linalg.norm(vertices - contact.position, axis=1).min()
            assert gap < 0.01


def test_footprints_come_once(plan: ContactPlan) -> None:
    marks = load_plan_geometry(plan).footprints
    assert [mark.state for mark in marks] == sorted(mark.state for mark in marks)
    for limb in {mark.limb for mark in marks}:
        places = np.array([mark.position for mark in marks if mark.limb == limb])
        assert np.linalg.norm(np.diff(places, axis=0), axis=1).min() > 0.01


def with_surface(plan: ContactPlan, surface: SurfaceEntry) -> ContactPlan:
    environment = plan.environment.model_copy(update={"meshes": (), "surfaces": (surface,)})
    return plan.model_copy(update={"environment": environment})


def test_surface_with_a_hole(plan: ContactPlan) -> None:
    """An L-shaped polygon with a hole on a slope of 45 degrees: area and normal are kept."""
    flat = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    hole = [(0.2, 0.2), (0.7, 0.2), (0.7, 0.7), (0.2, 0.7)]

    def tilt(loop: list[tuple[float, float]]) -> tuple[tuple[float, float, float], ...]:
        return tuple((x, y * 0.5**0.5, y * 0.5**0.5 + 1) for x, y in loop)

    surface = SurfaceEntry(id="slope", vertices=tilt(flat), holes=(tilt(hole),))
    mesh = load_plan_geometry(with_surface(plan, surface)).environment
    assert mesh.area == pytest.approx(3 - 0.25)
    assert np.allclose(mesh.face_normals, [0, -(0.5**0.5), 0.5**0.5])
    assert mesh.bounds[0] == pytest.approx([0, 0, 1])


@pytest.mark.parametrize(
    "vertices",
    [
        ((0, 0, 0), (1, 0, 0)),
        ((0, 0, 0), (1, 0, 0), (2, 0, 0)),
        ((0, 0, 0), (1, 0, 0), (1, 1, 0.3), (0, 1, 0)),
        ((0, 0, 0), (3, 1, 0), (3, 0, 0), (0, 2, 0)),
    ],
    ids=["two", "line", "bent", "crossed"],
)
def test_bad_surface(plan: ContactPlan, vertices: tuple[tuple[float, float, float], ...]) -> None:
    with pytest.raises(InvalidInput, match=r"environment\.surfaces\.0"):
        load_plan_geometry(with_surface(plan, SurfaceEntry(id="bad", vertices=vertices)))
