"""Pages in a browser: reports of `adaptive_bvh clearance`, a Recording, a study."""

import os
import struct
import time
import zlib

import numpy as np
import pytest
from browser import Browser, has_chromium
from meshes import ball, sheet, wave
from sequence_files import write_ply

import adaptive_bvh as ab
from adaptive_bvh._clearance import main
from adaptive_bvh._clearance._study import Motion
from adaptive_bvh._clearance._study_page import study_page

pytestmark = pytest.mark.skipif(not has_chromium(), reason="looks at pages in chromium")

WINDOWS = [(390, 844, 3), (1280, 800, 1), (1920, 1080, 1)]
SHOWN = """(() => {
  const canvas = document.getElementById("scene"), box = canvas.getBoundingClientRect();
  return [canvas.width, canvas.height, box.width, box.height];
})()"""
# How much of the picture shows something.
LOOKS = """(() => {
  const {pixels, width, height} = adaptiveBvhPage.pixels();
  let drawn = 0;
  for (let i = 3; i < pixels.length; i += 4) drawn += pixels[i] > 0;
  return drawn / (width * height);
})()"""


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with Browser(tmp_path_factory.mktemp("profile")) as found:
        yield found


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    """The page of a run with a number of pairs, by that number."""
    try:
        ab.Recording()
    except RuntimeError as missing:
        pytest.skip(str(missing))
    folder = tmp_path_factory.mktemp("reports")
    vertices, faces = ball(1)
    for k in range(4):
        write_ply(folder / f"hose_{k}.ply", wave(vertices, 0.8 * k) + [0.9 * k, 0.2 * k, 0], faces)
    vertices, faces = sheet(1, 1.0)
    for i in range(20):
        write_ply(folder / f"part{i:02}.ply", vertices + [0.3 * i, 0.3 * (i % 3), -1.7], faces)

    def write(pairs):
        page = folder / f"report{pairs}.html"
        parts = "part*.ply" if pairs == 20 else "part0[0-1].ply"
        if not page.exists():
            main(["clearance", "--moving", str(folder / "hose_*.ply"), "--unit", "mm",
                  "--parts", str(folder / parts), "--clearance", "1mm", "--report", str(page)])
        return page
    return write


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """The page of a Recording with charts."""
    vertices, faces = ball(1)
    mesh = ab.DeformableMesh(vertices, faces)
    try:
        recording = ab.Recording(title="A ball", unit="mm")
    except RuntimeError as missing:
        pytest.skip(str(missing))
    recording.add(mesh, name="ball")
    for k in range(5):
        mesh.update(wave(vertices, 0.5 * k))
        recording.frame(1.0 + k, series={"energy, J": 2.0 - k})
    page = tmp_path_factory.mktemp("recording") / "page.html"
    recording.write(page)
    return page


def check_size(browser, ratio):
    """The picture has the pixels that the screen has in its place."""
    settle(browser)
    wide, high, *shown = browser.evaluate(SHOWN)
    assert min(shown) > 200, shown
    wanted = [side * ratio for side in shown]
    assert abs(wide - wanted[0]) < 1 and abs(high - wanted[1]) < 1, (wide, high, wanted)


def check_picture(browser, ratio):
    """So it has, and shows something."""
    check_size(browser, ratio)
    assert browser.evaluate(LOOKS) > 0.05
    assert not browser.errors


def settle(browser):
    """Waits until a change of the layout has come to its observers."""
    browser.evaluate("new Promise((done) => requestAnimationFrame(() => setTimeout(done)))")


def write_filter(browser, text):
    browser.evaluate(f"""(() => {{
      const filter = document.getElementById("filter");
      filter.value = "{text}";
      filter.dispatchEvent(new Event("input"));
    }})()""")


@pytest.mark.parametrize("width, height, ratio", WINDOWS)
@pytest.mark.parametrize("pairs", [2, 20])
def test_the_picture_of_a_report_fills_its_place(browser, reports, pairs, width, height, ratio):
    browser.open(reports(pairs), width, height, ratio)
    check_picture(browser, ratio)
    browser.evaluate("for (const head of document.querySelectorAll('#table th')) head.click()")
    check_size(browser, ratio)
    write_filter(browser, "part01")
    check_size(browser, ratio)
    browser.resize(width + 57, height - 90, ratio)
    check_picture(browser, ratio)


@pytest.mark.parametrize("width, height, ratio", WINDOWS)
def test_the_picture_of_a_recording_fills_its_place(browser, recording, width, height, ratio):
    browser.open(recording, width, height, ratio)
    check_picture(browser, ratio)
    sizes = """[...document.querySelectorAll(".chart canvas")].map((canvas) =>
      [canvas.width, canvas.clientWidth, canvas.height, canvas.clientHeight])"""
    for wide, wide_shown, high, high_shown in browser.evaluate(sizes):
        assert wide == round(wide_shown * ratio) and high == round(high_shown * ratio)
    # What the page shows changes without the window.
    for width in ("80%", "100%"):
        browser.evaluate(f"document.querySelector('main').style.width = '{width}'")
        check_size(browser, ratio)
        for wide, wide_shown, high, high_shown in browser.evaluate(sizes):
            assert wide == round(wide_shown * ratio) and high == round(high_shown * ratio)


def test_a_page_that_was_hidden_shows_its_picture(browser, recording):
    browser.open(recording, 1280, 800)
    for display in ("none", ""):
        browser.evaluate(f"document.body.style.display = '{display}'")
        settle(browser)
    check_picture(browser, 1)


@pytest.mark.parametrize("width, height, ratio", [*WINDOWS, (1024, 500, 1)])
def test_nothing_of_a_report_stands_over_another_part(browser, reports, width, height, ratio):
    browser.open(reports(20), width, height, ratio)
    gap, wide = browser.evaluate("""(() => {
      const below = (id) => document.getElementById(id).getBoundingClientRect().bottom;
      const table = document.getElementById("table").getBoundingClientRect();
      return [table.top - Math.max(...["stage", "transport", "words", "panel"].map(below)),
        document.documentElement.scrollWidth - innerWidth];
    })()""")
    assert gap >= 0 and wide <= 0


def column(browser, number):
    return browser.evaluate(f"""[...document.querySelectorAll("#table tbody tr")]
      .filter((row) => !row.hidden).map((row) => row.cells[{number}].textContent)""")


def test_the_table_is_sorted_and_filtered(browser, reports):
    browser.open(reports(20), 1280, 800)
    names, least = column(browser, 1), [float(text) for text in column(browser, 2)]
    assert len(names) == 20 and least == sorted(least) and names != sorted(names)
    for times, wanted in enumerate([sorted(names), sorted(names, reverse=True)]):
        browser.evaluate("document.querySelectorAll('#table th')[1].click()")
        assert column(browser, 1) == wanted, times
    browser.evaluate("document.querySelectorAll('#table th')[2].click()")
    assert [float(text) for text in column(browser, 2)] == least
    write_filter(browser, "PART1")
    browser.evaluate("""document.getElementById("filter").dispatchEvent(
      new KeyboardEvent("keydown", {key: "e", bubbles: true}))""")
    assert sorted(column(browser, 1)) == [f"part{i}" for i in range(10, 20)]
    assert not browser.evaluate("adaptiveBvhPage.settings.edges")  # the key went into the field


def read_png(path):
    """(height, width, 3)."""
    data, at, pixels = path.read_bytes(), 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", body[:10])
        pixels += body if kind == b"IDAT" else b""
        at += 12 + length
    assert depth == 8 and colour in (2, 6)
    channels = 3 if colour == 2 else 4
    rows = np.frombuffer(zlib.decompress(pixels), np.uint8).reshape(height, 1 + width * channels)
    image = np.zeros((height, width * channels), np.uint8)
    for y, (kind, row) in enumerate(zip(rows[:, 0], rows[:, 1:])):
        above = image[y - 1] if y else np.zeros_like(image[0])
        image[y] = _unfiltered(int(kind), row, above, channels)
    return image.reshape(height, width, channels)[:, :, :3]


def _unfiltered(kind, row, above, step):
    if kind == 0:
        return row
    if kind == 1:
        return np.cumsum(row.reshape(-1, step), axis=0, dtype=np.uint8).ravel()
    if kind == 2:
        return row + above
    out, up = [0] * step, [0] * step + above.tolist()
    for i, x in enumerate(row.tolist(), step):
        a, b, c = out[i - step], up[i], up[i - step]
        nearest = min((a, b, c), key=lambda side: abs(a + b - c - side))
        out.append((x + ((a + b) // 2 if kind == 3 else nearest)) & 255)
    return np.array(out[step:], np.uint8)


def saved_picture(browser, folder):
    """What the button saves."""
    browser.download_to(folder)
    browser.evaluate("document.getElementById('save-picture').click()")
    end = time.monotonic() + 20
    while not [name for name in os.listdir(folder) if name.endswith(".png")]:
        assert time.monotonic() < end, os.listdir(folder)
        time.sleep(0.05)
    return read_png(next(folder.glob("*.png")))


@pytest.mark.parametrize("width, height, ratio", [(390, 844, 2), (1280, 800, 1)])
def test_the_saved_picture_has_the_distance_and_its_legend(browser, reports, tmp_path, width,
                                                           height, ratio):
    browser.open(reports(20), width, height, ratio)
    check_picture(browser, ratio)
    image = saved_picture(browser, tmp_path)
    wide, high, *_ = browser.evaluate(SHOWN)
    assert image.shape[:2] == (high - high % 2, wide - wide % 2)
    places = browser.evaluate("""(() => {
      const scene = document.getElementById("scene").getBoundingClientRect();
      const place = (box) => [box.left - scene.left, box.top - scene.top, box.width, box.height];
      const text = (node) => {
        const range = document.createRange();
        range.selectNodeContents(node);
        return place(range.getBoundingClientRect());
      };
      const one = (name) => document.querySelector(name);
      return {tag: place(one("#tag").getBoundingClientRect()),
        ramp: place(one("#distance-legend .ramp").getBoundingClientRect()),
        texts: [...document.querySelectorAll("#distance-legend .title, .ends span, #scale")]
          .map(text)};
    })()""")

    def part(place):
        left, top, right, bottom = (round(ratio * x) for x in (
            place[0], place[1], place[0] + place[2], place[1] + place[3]))
        return image[top:bottom, left:right].astype(int)
    tag = part(places["tag"]).reshape(-1, 3)
    ground = np.abs(tag - [0xa3, 0x16, 0x4f]).max(axis=1) < 3
    ink = tag.min(axis=1) > 230  # white letters
    assert ground.mean() > 0.4 and 0.02 < ink.mean() < 0.5
    ramp = part(places["ramp"])
    middle = ramp[len(ramp) // 2]
    for share, colour in ((0.05, [0xb2, 0x18, 0x2b]), (0.95, [0x21, 0x66, 0xac])):
        assert np.abs(middle[int(share * len(middle))] - colour).max() < 40
    for place in places["texts"]:
        text = part(place)
        assert np.ptp(text, axis=(0, 1)).min() > 40, place  # letters on the ground
    title = image[:round(30 * ratio), :round(200 * ratio)].astype(int)
    assert np.ptp(title, axis=(0, 1)).min() > 100


@pytest.mark.parametrize("button", ["save-picture", "save-video"])
def test_what_cannot_be_saved_is_said(browser, recording, button):
    browser.open(recording, 1280, 800)
    check_picture(browser, 1)
    browser.evaluate("document.getElementById('stage').style.height = 0")
    browser.evaluate("document.getElementById('stage').style.border = 0")
    settle(browser)
    browser.evaluate(f"document.getElementById('{button}').click()")
    settle(browser)
    status = "document.getElementById('export-status')"
    assert "is not saved: the page has no room" in browser.evaluate(f"{status}.textContent")
    assert browser.evaluate(f"{status}.getBoundingClientRect().height") > 0
    assert browser.evaluate(f"document.getElementById('{button}').textContent") == (
        "Save picture" if button == "save-picture" else "Save video")
    assert not browser.errors


def test_a_failure_of_the_page_is_shown(browser, recording):
    browser.open(recording, 1280, 800)
    message = "document.getElementById('message')"
    assert browser.evaluate(f"{message}.hidden")
    for script in ("setTimeout(() => { throw new Error('lost'); })",
                   "Promise.reject(new Error('lost')); 0"):
        browser.evaluate(f"{message}.hidden = true")
        browser.evaluate(script)
        browser.until(f"!{message}.hidden && {message}.textContent.includes('lost')")
    browser.evaluate(f"{message}.hidden = true")
    browser.evaluate("""(window.lost = document.getElementById("scene").getContext("webgl")
      .getExtension("WEBGL_lose_context")).loseContext()""")
    browser.until(f"!{message}.hidden")
    browser.evaluate("document.getElementById('save-picture').click()")
    browser.until("document.getElementById('export-status').textContent.includes('not saved')")
    browser.evaluate("lost.restoreContext()")
    browser.until(f"{message}.hidden")
    assert browser.evaluate(LOOKS) > 0.05


def test_a_browser_without_webgl_says_so(recording, tmp_path):
    with Browser(tmp_path / "profile", "--disable-3d-apis") as browser:
        browser.open(recording, 1280, 800)
        assert not browser.evaluate("document.getElementById('message').hidden")
        assert "no WebGL" in browser.evaluate("document.getElementById('message').textContent")
        browser.evaluate("document.getElementById('save-picture').click()")
        settle(browser)
        status = browser.evaluate("document.getElementById('export-status').textContent")
        assert "no WebGL" in status
        assert not browser.errors


@pytest.mark.parametrize("width, height, ratio", WINDOWS)
def test_the_page_of_a_study_fits_its_window(browser, tmp_path, width, height, ratio):
    motions = [Motion(f"motion{i}", [["a.ply"]], {"length": str(i), "kind": "ab"[i % 2]})
               for i in range(20)]
    done = {f"motion{i}": {"status": i % 2, "headline": "", "limit": 2.0, "unit": "mm", "rows": [
        ["hose", "part", "mm", "1.0", str(1 + 0.1 * i), f"{i}.5"]]} for i in range(20)}
    page = tmp_path / "study.html"
    page.write_text(study_page(str(page), motions, done), encoding="utf-8")
    browser.open(page, width, height, ratio)
    wide, rows, plots = browser.evaluate("""[document.documentElement.scrollWidth - innerWidth,
      document.querySelectorAll("tbody tr").length,
      [...document.querySelectorAll("svg")]
        .map((plot) => [plot.clientWidth, plot.clientHeight])]""")
    assert wide <= 0 and rows == 20 and plots
    for plot in plots:
        assert plot[0] > 200 and abs(plot[0] / plot[1] - 290 / 165) < 0.05
    assert not browser.errors
