"""Reports in a real browser: nothing fails, nothing sticks out, tables sort, dark is dark."""

from __future__ import annotations

import pytest

from artde_gym.palette import STYLES
from artde_gym.report.chart import Axis, Chart

pytestmark = pytest.mark.browser

PHONE = 375  # pixels
BRIGHTNESS = """
(() => {
  const [r, g, b] = getComputedStyle(document.body).%s.match(/[0-9.]+/g).map(Number);
  return (r + g + b) / 3;
})()"""
HIDDEN = """
[...document.querySelectorAll("main *")].filter((part) => {
  const box = part.getBoundingClientRect();
  return box.width > 0 && box.right > innerWidth + 1 && !part.closest(".scroll") && !part.closest("svg");
}).length"""


@pytest.fixture(params=["walks", "flights", "bracket", "training"])
def report(request):
    return request.getfixturevalue(request.param) / "report.html"


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", [PHONE, 1280])
def test_page_opens_without_an_error_and_fits(browser, report, width, dark):
    browser.errors.clear()
    browser.open(report, width, dark=dark)
    assert browser.errors == []
    assert browser.run("document.documentElement.scrollWidth") <= width
    assert browser.run(HIDDEN) == 0
    assert browser.run("[...document.images].every((image) => image.complete && image.naturalWidth > 0)")
    drawn = "[...document.querySelectorAll('.chart svg')].every((chart) => chart.getBoundingClientRect().width > 200)"
    assert browser.run(drawn)


def test_dark_mode_is_dark_and_light_mode_is_light(browser, report):
    for dark in (False, True):
        browser.open(report, dark=dark)
        paper, ink = browser.run(BRIGHTNESS % "backgroundColor"), browser.run(BRIGHTNESS % "color")
        assert (paper < 60 < 200 < ink) if dark else (ink < 60 < 200 < paper)


def test_a_controllers_colour_is_lifted_in_the_dark_and_exact_in_the_light(browser, walks):
    color = "getComputedStyle(document.querySelector('.chart svg .line, .chart svg .path')).stroke"
    browser.open(walks / "report.html")
    light = browser.run(color)
    assert light == "rgb(0, 114, 178)"  # of TDE
    browser.open(walks / "report.html", dark=True)
    assert browser.run(color) != light


def test_a_figure_in_a_file_has_the_reports_colors(browser, tmp_path):
    chart = Chart("A line", Axis("x", 0.0, 1.0), Axis("y", 0.0, 1.0))
    chart.line([0.0, 1.0], [0.0, 1.0], STYLES["tde"])
    (tmp_path / "figure.svg").write_text(chart.file(), encoding="utf-8")
    color = "getComputedStyle(document.querySelector('.line')).stroke"
    browser.open(tmp_path / "figure.svg")
    light = browser.run(color)
    assert light == "rgb(0, 114, 178)"
    browser.open(tmp_path / "figure.svg", dark=True)
    assert browser.run(color) != light


def test_black_shows_in_the_dark(browser, walks):
    browser.open(walks / "report.html", dark=True)
    seen = browser.run("""
        (() => {
          const line = document.querySelector('.chart svg .line, .chart svg .path');
          line.style.setProperty('--c', '#000000');
          const paint = document.createElement('canvas').getContext('2d');
          paint.fillStyle = getComputedStyle(line).stroke;
          paint.fillRect(0, 0, 1, 1);
          return [...paint.getImageData(0, 0, 1, 1).data];
        })()""")
    assert min(seen[:3]) > 100


def test_a_table_sorts_on_click_both_ways(browser, flights):
    browser.errors.clear()
    browser.open(flights / "report.html")
    table = "[...document.querySelectorAll('table')].find((table) => table.caption.innerText.includes('RMS error (m)'))"
    column = f"[...{table}.tBodies[0].rows].map((row) => Number(row.cells[2].dataset.v))"
    head = f"{table}.tHead.rows[0].cells[2]"
    before = browser.run(column)
    assert len(before) == 12
    for direction, expected in (("ascending", sorted(before)), ("descending", sorted(before)[::-1])):
        browser.run(f"{head}.querySelector('button').click()")
        assert browser.run(column) == expected
        assert browser.run(f"{head}.getAttribute('aria-sort')") == direction
    names = f"[...{table}.tBodies[0].rows].map((row) => row.cells[1].textContent)"
    browser.run(f"{table}.tHead.rows[0].cells[1].querySelector('button').click()")
    assert browser.run(names) == sorted(browser.run(names))
    assert browser.errors == []


def test_print_opens_what_is_folded(browser, walks):
    browser.open(walks / "report.html")
    assert not browser.run("[...document.querySelectorAll('details')].some((part) => part.open)")
    browser.run("window.dispatchEvent(new Event('beforeprint'))")
    assert browser.run("[...document.querySelectorAll('details')].every((part) => part.open)")
