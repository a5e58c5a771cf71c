"""The page in a real browser: no error, nothing asked of a network, modes that turn and vibrate."""

from __future__ import annotations

import base64
import re
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tyrecal.report.html.page import write_page

from . import toy
from .ring import TABLE_2
from .test_page import HOSTILE

selenium = pytest.importorskip("selenium")
BROWSER, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
pytestmark = pytest.mark.browser
FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--hide-scrollbars",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
]
OF_CANVAS = "return document.querySelector('.stage canvas')"
PICTURE = f"{OF_CANVAS}.toDataURL()"
# height over width of what is painted
FORM = f"""{OF_CANVAS.replace("return", "const canvas =")};
const {{ width, height }} = canvas, copy = new OffscreenCanvas(width, height);
const context = copy.getContext("2d", {{ willReadFrequently: true }});
context.drawImage(canvas, 0, 0);
const pixels = context.getImageData(0, 0, width, height).data;
let left = width, right = 0, top = height, bottom = 0;
for (let i = 0; i < width * height; i++) if (pixels[4 * i + 3]) {{
  const x = i % width, y = Math.floor(i / width);
  left = Math.min(left, x); right = Math.max(right, x);
  top = Math.min(top, y); bottom = Math.max(bottom, y);
}}
return (bottom - top) / (right - left);"""


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    from selenium.webdriver import Chrome, ChromeOptions
    from selenium.webdriver.chrome.service import Service

    options = ChromeOptions()
    options.binary_location = str(BROWSER)
    for flag in (*FLAGS, f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = Chrome(options=options, service=Service(DRIVER))
    yield driver
    driver.quit()


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = toy.write(tmp_path_factory.mktemp("toy") / "results")
    write_page(folder / "report.html", [folder])
    return (folder / "report.html").as_uri()


@pytest.fixture
def shown(browser: Any, address: str) -> Any:
    """The page at a telephone's or a desk's size."""
    return show(browser, address, 1280)


def show(browser: Any, address: str, width: int, **media: str) -> Any:
    features = [{"name": key.replace("_", "-"), "value": value} for key, value in media.items()]
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
    browser.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": 800, "deviceScaleFactor": 1, "mobile": width < 500},
    )
    browser.get(address)
    browser.execute_script(f"{OF_CANVAS}.scrollIntoView()")
    return browser


def changes(picture: Callable[[], object], seconds: float) -> bool:
    """Return whether a picture changes in this time."""
    first, end = picture(), time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(0.05)
        if picture() != first:
            return True
    return False


def press(browser: Any, selector: str) -> None:
    browser.find_element("css selector", selector).click()


def paused(browser: Any) -> None:
    if browser.execute_script("return document.querySelector('.viewer').dataset.playing") == "true":
        press(browser, ".play")


@pytest.mark.parametrize("width", [360, 768, 1280])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_no_error_no_request_and_nothing_beside_the_screen(
    browser: Any, address: str, width: int, scheme: str
) -> None:
    show(browser, address, width, prefers_color_scheme=scheme)
    assert browser.get_log("browser") == []
    assert browser.execute_script("return performance.getEntriesByType('resource').length") == 0
    assert browser.execute_script("return document.documentElement.scrollWidth") <= width
    dark = browser.execute_script("return getComputedStyle(document.body).backgroundColor")
    assert (dark == "rgb(255, 255, 255)") == (scheme == "light")
    wide = "[...document.querySelectorAll('{}.wide')].filter((each) => each.offsetParent)"
    cut = f"return {wide}.filter((each) => each.scrollWidth > each.clientWidth + 1).length"
    assert width < 1280 or not browser.execute_script(cut.format("#provenance "))
    assert width > 360 or browser.execute_script(cut.format("")) > 5
    hint = f"return {wide.format('')}.filter((each) => each.classList.contains('cut')).length"
    assert browser.execute_script(hint) == browser.execute_script(cut.format(""))


@pytest.mark.parametrize("width", [360, 1280])
def test_contents_stay_in_sight(browser: Any, address: str, width: int) -> None:
    show(browser, address, width)
    top = "return document.querySelector('nav').getBoundingClientRect().top"
    assert browser.execute_script(f"window.scrollTo(0, 6000); {top}") == 0
    last = "document.querySelector('nav a[href=\"#provenance\"]').click();"
    heading = "return document.querySelector('#provenance h2').getBoundingClientRect().top"
    place = browser.execute_script(f"{last} {heading}")
    assert 0 <= place < 800  # not below the contents, and on the screen


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_side_by_side_on_a_telephone(browser: Any, tmp_path: Path, scheme: str) -> None:
    """The table of five folders scrolls within the page, and what a row is stays in sight."""
    folders = [toy.write(tmp_path / f"study_{k}") for k in range(5)]
    write_page(tmp_path / "report.html", folders)
    show(browser, (tmp_path / "report.html").as_uri(), 360, prefers_color_scheme=scheme)
    assert browser.execute_script("return document.documentElement.scrollWidth") <= 360
    table = "const wide = document.querySelector('#comparison .wide'); "
    assert browser.execute_script(f"{table} return wide.scrollWidth > wide.clientWidth")
    left = "return wide.querySelector('th[scope=row]').getBoundingClientRect().left"
    before = browser.execute_script(f"{table} {left}")
    assert browser.execute_script(f"{table} wide.scrollLeft = 9999; {left}") == before


def test_modes_vibrate_until_they_are_stopped(shown: Any) -> None:
    canvas = shown.find_element("css selector", ".stage canvas")
    assert changes(lambda: canvas.screenshot_as_png, 5)
    press(shown, ".play")
    assert not changes(lambda: canvas.screenshot_as_png, 1)
    assert shown.find_element("css selector", ".play").text == "Play"
    press(shown, ".play")
    assert changes(lambda: shown.execute_script(PICTURE), 5)


def test_the_keyboard_the_mouse_and_a_finger_turn_it(shown: Any) -> None:
    from selenium.webdriver import ActionChains, Keys

    paused(shown)
    canvas = shown.find_element("css selector", ".stage canvas")
    picture = lambda: shown.execute_script(PICTURE)
    for key in (Keys.ARROW_LEFT, Keys.ARROW_UP):
        before = picture()
        canvas.send_keys(key)
        assert picture() != before, key
    before = picture()
    ActionChains(shown).drag_and_drop_by_offset(canvas, 60, 10).perform()
    assert picture() != before
    before, box = picture(), canvas.rect
    top = shown.execute_script(f"{OF_CANVAS}.getBoundingClientRect().top")
    for kind, x in (("touchStart", 100), ("touchMove", 130), ("touchMove", 160), ("touchEnd", 0)):
        place = {"x": box["x"] + x, "y": top + 100}
        shown.execute_cdp_cmd(
            "Input.dispatchTouchEvent",
            {"type": kind, "touchPoints": [] if kind == "touchEnd" else [place]},
        )
    assert picture() != before
    canvas.send_keys(" ")
    assert changes(picture, 5)


def test_an_oval_is_one(shown: Any) -> None:
    """[2,0] at its largest, seen along the axle, is higher than wide by what the motion says, half
    axes of the crown 1 + a and 1 - a (nearer parts look a little larger); a circle at rest."""
    paused(shown)
    names = [x.text for x in shown.find_elements("css selector", ".gallery strong")]
    chosen = next(i for i, name in enumerate(names) if name.startswith("[2,0] 79.42"))
    shown.find_elements("css selector", ".gallery button")[chosen].click()
    press(shown, "[data-view=front]")
    motion = "const range = document.querySelector('.viewer .most'); range.value = {};"
    tell = "range.dispatchEvent(new Event('input'));"
    shown.execute_script(motion.format(0) + tell)
    assert shown.execute_script(FORM) == pytest.approx(1.0, abs=0.01)
    shown.execute_script(motion.format(20) + tell)
    assert shown.execute_script(FORM) == pytest.approx(1.2 / 0.8, abs=0.08)


def test_zoom_and_the_second_of_a_pair(shown: Any) -> None:
    """Slider and keys zoom; the second [2,0] is the first turned by an eighth, so it is as high
    as wide."""
    from selenium.webdriver import Keys

    paused(shown)
    picture = lambda: shown.execute_script(PICTURE)
    canvas = shown.find_element("css selector", ".stage canvas")
    names = [x.text for x in shown.find_elements("css selector", ".gallery strong")]
    chosen = next(i for i, name in enumerate(names) if name.startswith("[2,0] 79.42"))
    shown.find_elements("css selector", ".gallery button")[chosen].click()
    press(shown, "[data-view=front]")
    first = picture()
    press(shown, ".second")
    assert "second of the pair" in shown.find_element("css selector", ".shown").text
    assert shown.execute_script(FORM) == pytest.approx(1.0, abs=0.01) and picture() != first
    press(shown, ".second")
    assert picture() == first
    canvas.send_keys("+")
    larger = picture()
    assert larger != first
    canvas.send_keys("-")
    canvas.send_keys(Keys.ARROW_LEFT)
    assert picture() != larger
    alone = next(i for i, name in enumerate(names) if name.startswith("[0,0] torsional"))
    shown.find_elements("css selector", ".gallery button")[alone].click()
    assert not shown.find_element("css selector", ".second").is_displayed()


def test_who_prefers_less_motion_gets_none(browser: Any, address: str) -> None:
    show(browser, address, 768, prefers_reduced_motion="reduce")
    assert not changes(lambda: browser.execute_script(PICTURE), 1)
    press(browser, ".play")
    assert changes(lambda: browser.execute_script(PICTURE), 5)


def test_it_prints_on_a4_every_mode(browser: Any, address: str) -> None:
    """The canvases hold each mode's shape, also from a dark screen."""
    show(browser, address, 768, prefers_color_scheme="dark")
    answer = browser.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})
    pdf = base64.b64decode(answer["data"])
    sizes = {
        tuple(map(float, box.split()))
        for box in re.findall(r"/MediaBox \[([\d. ]+)\]", pdf.decode("latin-1"))
    }
    assert sizes and all(abs(w - 595) < 2 and abs(h - 842) < 2 for _, _, w, h in sizes)
    small = "return [...document.querySelectorAll('.gallery canvas')].map((c) => c.toDataURL())"
    pictures = browser.execute_script(small)
    assert len(pictures) == len(set(pictures)) == len(TABLE_2) + 4
    shut = "return [...document.querySelectorAll('details')].filter((d) => !d.open).length"
    assert browser.execute_script(shut) == 0  # numbers are printed too


def test_a_hostile_name_is_only_a_name(browser: Any, tmp_path: Path) -> None:
    folder = toy.write(tmp_path / "results", HOSTILE, HOSTILE)
    write_page(folder / "report.html", [folder])
    show(browser, (folder / "report.html").as_uri(), 768)
    assert browser.execute_script("return window.hacked") is None
    assert browser.execute_script("return document.images.length") == 0
    assert browser.title.startswith("</script>") and browser.get_log("browser") == []
