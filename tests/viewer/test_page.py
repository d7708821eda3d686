"""The page of the viewer in a real browser."""

import hashlib
import re
from pathlib import Path

import browser
import numpy as np
import pandas as pd
import pytest

from cospeech.errors import UserError
from cospeech.formats import glb_mesh
from cospeech.geometry import rotation
from cospeech.motion import library
from cospeech.motion.body import STANDARD
from cospeech.viewer import page, takes, voice

FOLDER = Path(__file__).parent
FPS, N_FRAMES, DURATION_S = 20.0, 80, 4.0

needs_chromium = pytest.mark.skipif(browser.CHROMIUM is None, reason="needs Chromium (Debian package chromium)")


def some_poses(rng, n_joints):
    """Poses that change slowly and at random."""
    turns = np.cumsum(rng.normal(0.0, 0.05, (N_FRAMES, n_joints, 3)), axis=0)
    root = np.cumsum(rng.normal(0.0, 0.01, (N_FRAMES, 3)), axis=0)
    return library.Poses(root, rotation.to_quaternions(rotation.from_vectors(turns)))


@pytest.fixture(scope="module")
def moving():
    rng = np.random.default_rng(1)
    return [takes.Articulated(STANDARD, some_poses(rng, len(STANDARD.joints))) for _ in range(2)]


@pytest.fixture(scope="module")
def dressed():
    """Two joints on their own, and a surface that follows them."""
    rng = np.random.default_rng(2)
    turns = rotation.to_quaternions(rotation.from_vectors(rng.normal(0.0, 1.0, (3, 2, 3))))
    bind = np.tile(np.eye(4), (3, 1, 1))
    bind[:, :3] = rng.normal(0.0, 1.0, (3, 3, 4))
    triangle, slot, weight = np.arange(30).reshape(-1, 3), rng.integers(0, 3, (30, 4)), rng.dirichlet(np.ones(4), 30)
    position, colour = rng.uniform(-1, 1, (30, 3)), rng.uniform(0, 1, (30, 3))
    normal = np.tile([0.0, 1.0, 0.0], (30, 1))
    mesh = glb_mesh.Mesh(position, normal, colour, slot, weight, triangle, np.array([0, 1, 1]), bind)
    moved = takes.Free(("a", "b"), (-1, 0), rng.normal(0.0, 1.0, (3, 2, 3)), turns)
    return takes.Version("own", moved, FPS, mesh=mesh, head="another system")


@pytest.fixture(scope="module")
def made(moving, dressed, tmp_path_factory):
    time_s = np.arange(round(DURATION_S * 16000)) / 16000
    heard = voice.voice(0.3 * np.sin(2 * np.pi * 200 * time_s))
    phrases = pd.DataFrame({"start_s": [0.0, 1.5], "end_s": [1.5, 4.0], "label": ["rest", "</script>"]})
    versions = [
        takes.Version(title, motion, FPS, phrases, skinned=True)
        for title, motion in zip(("Original", "<b>Other</b>"), moving, strict=True)
    ]
    markers = takes.Free(("a", "b"), (-1, 0), np.array([[[0, 1, 0], [np.nan] * 3]] * 3, dtype=float))
    shown = [
        takes.Take("first", versions, heard.encoded, heard.duration_s, heard.curves, voice.CURVE_S),
        takes.Take("markers", [takes.Version("markers", markers, 100.0)]),
        takes.Take("dressed", [dressed]),
    ]
    path = tmp_path_factory.mktemp("page") / "viewer.html"
    path.write_text(page.page("test of the <viewer>", shown), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def opened(made, tmp_path_factory):
    with browser.tab(tmp_path_factory.mktemp("profile")) as tab:
        tab.size(1280, 900)
        tab.open(made)
        tab.value("viewer.ready")
        yield tab


@needs_chromium
def test_joints_are_seen_where_forward_kinematics_puts_them(opened, moving):
    opened.value("viewer.view(35)")
    for frame in (0, 17, 63):
        opened.value(
            f"(async () => {{ viewer.seek({(frame + 0.5) / FPS}); await new Promise(requestAnimationFrame); }})()"
        )
        camera = "viewer.scene.camera"
        view = np.array(opened.value(f"{camera}.matrixWorldInverse.elements")).reshape(4, 4).T
        lens = np.array(opened.value(f"{camera}.projectionMatrix.elements")).reshape(4, 4).T
        size = opened.value("[viewer.canvas.clientWidth, viewer.canvas.clientHeight]")
        for version, motion in enumerate(moving):
            places = STANDARD.world(motion.poses.root_m, motion.poses.rotations)[1][frame]
            shift = opened.value(f"viewer.figures[{version}].group.position.toArray()")
            clip = lens @ view @ np.vstack([(places + shift).T, np.ones(len(places))])
            expected = (clip[:2] / clip[3] * [[1], [-1]] + 1) / 2 * np.array(size)[:, None]
            for joint in range(0, len(places), 2):
                seen = opened.value(f"viewer.seen({version}, {joint})")
                assert np.abs(np.array(seen) - expected[:, joint]).max() < 2.0


@needs_chromium
def test_the_surface_follows_the_bones(opened, moving):
    opened.value("(async () => { viewer.seek(2); await new Promise(requestAnimationFrame); })()")
    bones = np.array(
        opened.value(
            "viewer.figures[1].joints.map(joint => joint.getWorldPosition(joint.position.clone()).toArray())"
        )
    )
    shift = opened.value("viewer.figures[1].group.position.toArray()")
    poses = moving[1].poses.resampled(np.array([2 * FPS - 0.5]))
    expected = STANDARD.world(poses.root_m, poses.rotations)[1][0]
    np.testing.assert_allclose(bones - shift, expected, atol=2e-3)


@needs_chromium
def test_a_surface_of_its_own_follows_the_joints_and_can_be_hidden(opened, dressed):
    opened.value("viewer.choose(2)")
    opened.value(f"(async () => {{ viewer.seek({1.5 / FPS}); await new Promise(requestAnimationFrame); }})()")
    seen = opened.value(
        "(() => { const { surface } = viewer.figures[0], spot = new THREE.Vector3(); surface.skeleton.update();"
        " return Array.from({ length: 30 }, (_, k) => surface.getVertexPosition(k, spot).toArray()); })()"
    )
    mesh, motion = dressed.mesh, dressed.motion
    joints = np.tile(np.eye(4), (2, 1, 1))
    joints[:, :3, :3], joints[:, :3, 3] = rotation.from_quaternions(motion.turns[1]), motion.places_m[1]
    corners = np.column_stack([mesh.position, np.ones(30)])
    expected = np.einsum("nk,nkab,nb->na", mesh.weight, (joints[mesh.joint] @ mesh.bind)[mesh.slot], corners)[:, :3]
    np.testing.assert_allclose(seen, expected, atol=1e-3)
    assert opened.value("viewer.figures[0].chip.textContent") == "own · head: another system"
    drawn = {}
    for look in ("body", "skeleton", "axes"):
        opened.value(f"(async () => {{ viewer.look = '{look}'; viewer.changed = true;"
                     " await new Promise(requestAnimationFrame); })()")  # fmt: skip
        parts = "['surface', 'bones', 'axes'].map(part => viewer.figures[0][part].visible)"
        drawn[look] = opened.value(parts)
    opened.value("viewer.look = 'body'; viewer.choose(0)")
    assert drawn == {"body": [True, False, False], "skeleton": [False, True, False], "axes": [False, True, True]}


@needs_chromium
def test_motion_follows_the_clock_of_the_sound(opened):
    opened.value("(async () => { viewer.seek(0.5); viewer.setPlaying(true); })()")
    opened.wait("viewer.clock.audio.currentTime > 1")
    heard, *differences = opened.value(
        "(async () => { const found = [viewer.clock.heard]; for (let k = 0; k < 20; k++) {"
        " await new Promise(requestAnimationFrame);"
        " found.push(Math.abs(viewer.clock.time - viewer.clock.audio.currentTime)); } return found; })()"
    )
    assert heard is True
    assert max(differences) < 1 / FPS
    opened.wait("!viewer.clock.playing")  # it stops at the end
    assert opened.value("viewer.time") == pytest.approx(DURATION_S, abs=0.1)


@needs_chromium
def test_keys_play_step_and_choose(opened):
    opened.value("viewer.element.focus(); viewer.seek(1.025)")
    opened.press("ArrowRight")
    assert opened.value("viewer.clock.at") == pytest.approx(1.075)
    opened.press("ArrowLeft")
    assert opened.value("viewer.clock.at") == pytest.approx(1.025)
    opened.press("2")
    assert opened.value("viewer.figures.map(figure => figure.on)") == [True, False]
    opened.press("2")
    opened.press("o")
    assert opened.value("viewer.overlaid") is True
    opened.press("o")
    opened.press(" ")
    assert opened.value("viewer.clock.playing") is True
    opened.press(" ")
    assert opened.value("viewer.clock.playing") is False


@needs_chromium
def test_a_click_on_the_timeline_jumps_there(opened):
    box = opened.value(
        "(() => { const b = viewer.scrubber.getBoundingClientRect(); return [b.left, b.top, b.width]; })()"
    )
    left = opened.value("viewer.timeline.left")
    place = {"x": box[0] + left + 0.25 * (box[2] - left - 6), "y": box[1] + 30, "button": "left", "clickCount": 1}
    opened.call("Input.dispatchMouseEvent", type="mousePressed", **place)
    opened.call("Input.dispatchMouseEvent", type="mouseReleased", **place)
    assert opened.value("viewer.clock.at") == pytest.approx(0.25 * DURATION_S, abs=0.02)


@needs_chromium
def test_another_take_is_shown(opened):
    opened.value("viewer.choose(1)")
    assert opened.value("viewer.figures.length") == 1
    assert opened.value("viewer.clock.duration") == pytest.approx(0.03)
    opened.value("viewer.choose(0)")


@needs_chromium
def test_no_request_leaves_the_page_and_nothing_fails(opened, made):
    assert {url.split(":")[0] for url in opened.requests} <= {"file", "data", "blob"}
    assert [url for url in opened.requests if url.startswith("file")] == [made.as_uri()]
    assert opened.errors == []


@needs_chromium
@pytest.mark.parametrize("width", [1280, 390])
def test_there_is_no_serious_violation_of_accessibility(opened, width):
    opened.size(width, 900)
    opened.value((FOLDER / "vendor/axe.min.js").read_text(encoding="utf-8"))
    found = opened.value(
        "axe.run().then(found => found.violations.filter(one => ['serious', 'critical'].includes(one.impact))"
        ".map(one => `${one.id}: ${one.nodes.map(node => node.html).join(' ')}`))"
    )
    assert found == []
    assert opened.value("document.documentElement.scrollWidth") <= width
    assert len(opened.picture()) > 10_000


@needs_chromium
def test_without_webgl_the_page_says_so(made, tmp_path):
    with browser.tab(tmp_path, "--disable-gpu", "--disable-3d-apis") as tab:
        tab.open(made)
        tab.wait("!viewer.note.hidden")
        assert "no WebGL" in tab.value("viewer.note.textContent")
        tab.value("viewer.ready")
        tab.value("viewer.seek(3.5); viewer.setPlaying(true)")
        tab.wait("!viewer.clock.playing && viewer.time > 3.9")  # it plays up to the end
        assert "0:04" in tab.value("viewer.clockText.textContent")
        assert tab.errors == []


def test_the_bundle_is_the_one_that_is_documented():
    vendor = Path(page.__file__).parent / "vendor"
    stated = re.search(r"SHA-256: `(\w+)`", (vendor / "README.md").read_text(encoding="utf-8"))
    assert stated
    assert stated[1] == hashlib.sha256((vendor / "three.js").read_bytes()).hexdigest()


def test_the_same_takes_give_the_same_page(moving):
    shown = [takes.Take("take", [takes.Version("one", moving[0], FPS)])]
    assert page.page("title", shown) == page.page("title", shown)


def test_a_version_without_frames_is_refused():
    nothing = takes.Free((), (), np.empty((0, 0, 3)))
    with pytest.raises(UserError, match="contains no frame"):
        takes.packed(takes.Take("take", [takes.Version("one", nothing, FPS)]))


def test_a_body_far_away_is_refused(moving):
    poses = library.Poses(moving[0].poses.root_m + 1e6, moving[0].poses.rotations)
    with pytest.raises(UserError, match="unit of length"):
        takes.packed(takes.Take("take", [takes.Version("one", takes.Articulated(STANDARD, poses), FPS)]))
